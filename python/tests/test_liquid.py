import psidpd
import pytest

WATER = psidpd.Liquid("water", density=997.0, tension=0.072, compressibility=4.525e-10, temperature=298.15, molar_mass=0.018015)


def test_numbers_that_cannot_be_used_are_refused(tmp_path):
    out = tmp_path / "water.toml"
    with pytest.raises(psidpd.InputError, match="size of a particle"):
        WATER.model(out)
    with pytest.raises(psidpd.InputError, match="molecules and rc"):
        WATER.model(out, molecules=2, rc=1e-9)
    with pytest.raises(psidpd.InputError, match="SI units"):
        psidpd.Liquid("water", density=0.997).model(out, rc=1e-9)
    assert not out.exists()


def test_impossible_liquids_have_a_table_and_no_file(tmp_path):
    found = WATER.model(tmp_path / "water.toml", molecules=1000)
    assert not found["good"] and found["refusals"][0]["kind"] == "too-stiff"
    assert found["refusals"][0]["nearest_molecules"] < 10
    assert not (tmp_path / "water.toml").exists()


def test_walls_that_cannot_be_are_refused(tmp_path):
    model = tmp_path / "gas.toml"
    model.write_text('title = "g"\nspecies = ["F"]\n[[pair]]\nbetween = ["F", "F"]\nform = "soft"\nstrength = 25.0\nrange = 1.0\n')
    out = tmp_path / "wall.toml"
    for options, why in [({"contact_angle": 60}, "do not attract"), ({"contact_angle": 190}, "160 degrees"), ({"contact_angle": 60.0, "kT": -1}, "kT")]:
        with pytest.raises(psidpd.InputError, match=why):
            psidpd.wall(model, out, **options)
    assert not out.exists()


def test_liquids_that_cannot_be_mixed_are_refused(tmp_path):
    gas = tmp_path / "gas.toml"
    gas.write_text('title = "g"\nspecies = ["F"]\n[[pair]]\nbetween = ["F", "F"]\nform = "soft"\nstrength = 25.0\nrange = 1.0\n')
    out = tmp_path / "both.toml"
    for options, why in [
        ({"tension": 1.0}, "both liquids are called gas"),
        ({"tension": -1.0}, "above 0"),
        ({"tension": 1.0, "species": ("a", "b"), "densities": (3.0, -3.0)}, "above 0"),
        ({"tension": 1.0, "species": ("a", "b")}, "theory knows no liquid of a"),
    ]:
        with pytest.raises(psidpd.InputError, match=why):
            psidpd.mixture(gas, gas, out, **options)
    assert not out.exists()


def test_coolprop_knows_water():
    pytest.importorskip("CoolProp")
    water = psidpd.Liquid.from_coolprop("Water", T=298.15)
    # Tables of IAPWS.
    assert water.density == pytest.approx(997.0, rel=1e-3) and water.tension == pytest.approx(0.0720, rel=2e-3)
    assert water.compressibility == pytest.approx(4.525e-10, rel=2e-3) and water.viscosity == pytest.approx(8.90e-4, rel=5e-3)
    assert water.molar_mass == pytest.approx(0.018015, rel=1e-4) and water.temperature == 298.15
    for fluid, kelvin in [("Water", 700.0), ("phlogiston", 300.0)]:
        with pytest.raises(psidpd.InputError, match="no saturated liquid"):
            psidpd.Liquid.from_coolprop(fluid, T=kelvin)
