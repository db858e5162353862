import pickle

import numpy
import psidpd
import pytest
from conftest import MODELS

VAN_DER_WAALS = MODELS / "van-der-waals-3d.toml"


def test_pressure_is_the_formula_of_the_equation_of_state():
    # psi = k n: p = rho kT + rho^2 k in mean field.
    model = psidpd.Model.from_text(
        'title = "linear"\nspecies = ["F"]\n[parameters]\nk = 2.5\n[density.n]\nkernel = "quadratic"\nrange = 1.0\n'
        '[excess_free_energy]\nF = "k*n"\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n'
    )
    rho = numpy.array([[0.5, 1.0], [2.0, 6.0]])
    found = model.pressure(rho, kT=0.7)
    assert found.shape == (2, 2) and found.dtype == numpy.float64
    assert found == pytest.approx(0.7 * rho + 2.5 * rho**2, rel=1e-12)
    assert isinstance(model.pressure(3.0, 0.7), float)
    assert model.pressure(3.0, 0.7) == pytest.approx(2.1 + 22.5)
    # Other types, and arrays that are not in one piece.
    assert model.pressure(rho.T.astype(numpy.float32), 0.7) == pytest.approx(found.T, rel=1e-6)
    assert model.pressure(numpy.arange(1, 9)[::3], 0.7)[1] == pytest.approx(0.7 * 4 + 2.5 * 16)
    for density in [-1.0, numpy.inf, numpy.nan]:
        with pytest.raises(psidpd.InputError, match="finite number that is not negative"):
            model.pressure(density, 0.7)
    assert model.parameters == {"k": 2.5} and model.species == ["F"] and model.dimensions == 3


def test_pressure_of_a_mixture_has_a_density_for_each_species(huggins):
    rho = numpy.full((5, 2), 8.0)
    found = huggins.pressure(rho, 1.0)
    # Trofimov et al., Table: p theory 969.4.
    assert found.shape == (5,) and found == pytest.approx(969.4, rel=1e-3)
    with pytest.raises(psidpd.InputError, match=r"shape \(2, 5\).*2 entries"):
        huggins.pressure(rho.T, 1.0)


def test_phases_meet_at_one_pressure():
    model = psidpd.Model.from_file(VAN_DER_WAALS)
    table = model.phase_diagram([0.8 * kT for kT in (1.0, 1.1)])
    assert len(table) == 2
    for _, row in table.iterrows():
        if numpy.isnan(row["liquid"]):
            assert row["note"]
            continue
        assert row["vapour"] < row["spinodal_low"] < row["spinodal_high"] < row["liquid"]
        for phase in ("vapour", "liquid"):
            assert model.pressure(row[phase], row["kT"]) == pytest.approx(row["pressure"], rel=1e-5)
    assert not table["liquid"].isna().all()
    hot = model.phase_diagram(50.0)
    assert len(hot) == 1 and numpy.isnan(hot["liquid"][0]) and "coexist" in hot["note"][0]


def test_phases_of_a_mixture_need_a_density(huggins):
    with pytest.raises(psidpd.InputError, match="total number density"):
        huggins.phase_diagram(1.0)
    demixing = psidpd.Model.from_file(MODELS / "huggins-demixing.toml")
    row = demixing.phase_diagram(1.0, density=16.0).iloc[0]
    assert 0.0 < row["composition_low"] < 0.5 < row["composition_high"] < 1.0


def test_errors_name_file_line_and_key(tmp_path):
    text = (MODELS / "warren2003-set6.toml").read_text().replace("gamma = 18.0", "gamma = 18.0\ngama = 18.0")
    path = tmp_path / "typo.toml"
    path.write_text(text)
    with pytest.raises(psidpd.InputError) as raised:
        psidpd.Model.from_file(path)
    said = str(raised.value)
    line = 1 + text[: text.index("gama")].count("\n")
    assert "gama" in said and f"typo.toml:{line}" in said, said
    assert isinstance(raised.value, ValueError) and isinstance(raised.value, psidpd.PsidpdError)
    with pytest.raises(psidpd.InputError, match="cannot be read"):
        psidpd.Model.from_file(tmp_path / "none.toml")
    with pytest.raises(psidpd.InputError, match="kT"):
        psidpd.Model.from_file(MODELS / "warren2003-set6.toml").pressure(1.0, kT=-1.0)


def test_a_model_goes_to_other_processes(warren):
    again = pickle.loads(pickle.dumps(warren))
    assert again.title == warren.title and again.text == warren.text
