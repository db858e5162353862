//! Every key of the model file, as tables. A file with other keys is refused; the JSON schema for
//! editors and the reference `docs/model-file.md` are generated from the tables too.

use super::kernel::KernelKind;
use crate::continuation::Continuation;
pub use crate::document::keys::{Key, OPTIONAL, REQUIRED, Table, ValueKind};
use crate::document::keys::{count, joined, keys, names};
use crate::pair::FORM_KEYS;
pub use crate::pair::FORMS;

fn kernels() -> Vec<&'static str> {
    KernelKind::ALL.iter().map(|k| k.name()).collect()
}

/// Every table, in the order of the documentation.
pub const TABLES: &[Table] = &[TOP, UNITS, PARAMETERS, DENSITY, EXCESS, CURVES, PAIR, THERMOSTAT, LITERATURE];

const TOP: Table = Table::new(
    "",
    "The name of the model and its particles.",
    keys! {
        "title": ValueKind::Text, REQUIRED,
            "The name of the model."
            => "title = \"Warren 2003, set 6\"";
        "reference": ValueKind::Text, OPTIONAL,
            "The source of the model."
            => "reference = \"Phys. Rev. E 68, 066702 (2003), Table 2\"";
        "dimensions": ValueKind::Dimensions, OPTIONAL,
            "The space the particles live in; 3 if left out."
            => "dimensions = 2";
        "species": ValueKind::Species, REQUIRED,
            "The species, 1 to 64. Their order is the order of every list of species in results."
            => "species = [\"A\", \"B\"]";
    },
);

const UNITS: Table = Table::new(
    "units",
    "What the numbers of the model stand for, in SI. LAMMPS's `dpd/psi` needs this table in units other \
     than `lj`; nothing else uses it. The unit of time is `length sqrt(mass/energy)`.",
    keys! {
        "length": ValueKind::Positive, REQUIRED,
            "The unit of length in metres."
            => "[units]\nlength = 7.11e-10\nmass = 1.5e-25\nenergy = 4.14e-21";
        "mass": ValueKind::Positive, REQUIRED,
            "The unit of mass in kilograms."
            => "[units]\nlength = 1e-9\nmass = 3e-25\nenergy = 4.14e-21";
        "energy": ValueKind::Positive, REQUIRED,
            "The unit of energy in joules: `k_B` times 300 K, if one temperature of the model is 300 K."
            => "[units]\nlength = 1e-9\nmass = 3e-25\nenergy = 4.14e-21";
    },
);

const PARAMETERS: Table = Table::new(
    "parameters",
    "Constants, for every formula and every number of the file. They may refer to each other in any \
     order. `kT` is not a parameter and cannot appear in formulas of parameters: the host gives the \
     temperature, and all other formulas know it as `kT`.",
    keys! {
        "NAME": ValueKind::Parameter, OPTIONAL,
            "A constant."
            => "[parameters]\nb = 0.0156\na = \"1.9*b\"";
    },
);

const DENSITY: Table = Table::new(
    "density.NAME",
    "A weighted local density `n_B(i) = sum over j of species B of w(r_ij)`, with `[w] = 1`. A density \
     `n` of species A, B gives formulas the variables `n_A`, `n_B` and `n = n_A + n_B`. A model may have \
     any number of densities.",
    keys! {
        "kernel": ValueKind::Choice(kernels), REQUIRED,
            "The weight function `w`."
            => "[density.n]\nkernel = \"wendland-c2\"\nrange = 1.0";
        "force_kernel": ValueKind::Choice(kernels), OPTIONAL,
            "The kernel whose slope gives the force; `kernel` if left out. A kernel that differs from `kernel` \
             gives a force without potential, which heats: LAMMPS's `mdpd` is `lucy` with `quadratic`."
            => "[density.n]\nkernel = \"lucy\"\nforce_kernel = \"quadratic\"\nrange = 0.75";
        "range": ValueKind::NumberOrFormula, REQUIRED,
            "The distance at which `w` vanishes."
            => "[density.n]\nkernel = \"quadratic\"\nrange = \"3*rc/4\"\n[parameters]\nrc = 1.0";
        "self": ValueKind::Flag, OPTIONAL,
            "Whether `w(0)` counts in a particle's own density; false if left out. With `self = true` the mean \
             of `n` is the density plus `w(0)` (Trofimov)."
            => "[density.n]\nkernel = \"quadratic\"\nrange = 1.0\nself = true";
        "correction": ValueKind::Correction, OPTIONAL,
            "Trofimov's corrected density, a polynomial of the weighted density in ascending powers. For \
             mixtures a table by `\"A|B\"`, the density of A felt by B; pairs left out are not corrected. \
             Formulas use the corrected densities."
            => "species = [\"A\", \"B\"]\n[density.n]\nkernel = \"quadratic\"\nrange = 1.0\ncorrection = { \
             \"A|A\" = [1.57, 1.0], \"A|B\" = [0.13, 1.0], \"B|A\" = [0.13, 1.0], \"B|B\" = [1.57, 1.0] }";
        "bounds": ValueKind::Bounds, OPTIONAL,
            "The range of densities in which psi is used as written. For a (corrected) density `x` outside it, \
             with `x_c` the nearer bound and `d = x - x_c`, psi is `psi + d psi' + d^2 psi''/2` at `x_c`: psi' \
             continues linearly. The rule applies to each partial density of a formula, one after the other, \
             and to the total of a table or pressure. The number of evaluations outside the bounds is counted."
            => "[density.n]\nkernel = \"quadratic\"\nrange = 1.0\nbounds = [0.05, \
             20.0]\n[excess_free_energy]\nA = \"kT*ln(n)\"";
        "below": ValueKind::Choice(|| names(&Continuation::NAMED)), OPTIONAL,
            "How psi' continues below the lower bound: `linear`, as above, if left out; `constant`, without the \
             last term, which makes the force there a pair force as in standard DPD. Trofimov suggests it where \
             psi is singular in thin regions. The force stays conservative, but the fluid does not follow its \
             equation of state there."
            => "[density.n]\nkernel = \"quadratic\"\nrange = 1.0\nbounds = [0.5, 20.0]\nbelow = \
             \"constant\"\n[excess_free_energy]\nA = \"kT*ln(n)\"";
    },
);

const EXCESS: Table = Table::new(
    "excess_free_energy",
    "`psi`, the excess free energy per particle, of every species, in units of energy; forces are \
     `-[dpsi_i/dn + dpsi_j/dn] w'(r)`. Formulas know the densities' variables, the parameters, `kT`, \
     `pi`, `+ - * / ^` (or `**`), `ln` (or `log`: the natural logarithm), `log10`, `exp`, `sqrt`, `sin`, \
     `cos`, `tanh`, `abs`, `min`, `max`. Without this table no species has a psi; if only some species \
     have one, write `\"0\"` for the others.",
    keys! {
        "SPECIES": ValueKind::Excess, OPTIONAL,
            "psi of one species."
            => "species = [\"A\", \"B\"]\n[density.n]\nkernel = \"quadratic\"\nrange = \
             1.0\n[excess_free_energy]\nA = \"n_B + 0.2*n_A\"\nB = \"n_A + 0.2*n_B\"";
    },
);

const CURVES: Table = Table::new(
    "excess_free_energy.SPECIES",
    "Instead of a formula: psi as a function of the total of one density, from a table or from an \
     equation of state, or a force law that has no psi. One of `table`, `pressure` and `slopes`.",
    keys! {
        "table": ValueKind::TableFile, OPTIONAL,
            "Rows of `n` and `psi`, separated by commas or blanks, with `#` for comments; a first row that is \
             not numeric is a header. psi is the cubic spline through the rows (not a knot), and psi' its exact \
             slope; beyond the ends psi' continues linearly. With `PSIDPD_TABLES_ANYWHERE=1` in the environment \
             the file may be anywhere."
            => "[excess_free_energy]\nA = { table = \"psi.csv\" }";
        "pressure": ValueKind::Pressure, OPTIONAL,
            "The target equation of state, for one species: a formula of `rho` and `kT`, or a table with rows \
             of `rho` and `p`, measured at the kT of the run. `psi' = (p - rho kT)/rho^2`; psi is the integral \
             of psi', from a density where it is finite. Beyond the ends of a table psi' continues linearly."
            => "[excess_free_energy]\nA = { pressure = \"rho*kT/(1 - 0.016*rho) - 0.03*rho^2\" }";
        "density": ValueKind::Text, OPTIONAL,
            "The density that psi depends on, required if the model has several."
            => "[density.n]\nkernel = \"quadratic\"\nrange = 1.0\n[density.m]\nkernel = \"quadratic\"\nrange = \
             0.75\n[excess_free_energy]\nA = { table = \"psi.csv\", density = \"m\" }";
        "slopes": ValueKind::Slopes, OPTIONAL,
            "A many-body force that is stated and not derived: formulas of the densities, by their variables, \
             that replace `dpsi/dn`; slopes left out are 0. Unless they are the slopes of one psi, the force \
             has no potential, does work around closed loops and heats. This key exists to reproduce such laws: \
             LAMMPS's `mdpd` with coefficients by pair of types has no potential (Warren's no-go theorem, Phys. \
             Rev. E 87, 045303). Densities with `bounds` are refused; theory and `export eam` do not apply."
            => "species = [\"A\", \"B\"]\n[density.n]\nkernel = \"lucy\"\nforce_kernel = \"quadratic\"\nrange \
             = 0.75\n[excess_free_energy]\nA = { slopes = { n_A = \"1.6*n\", n_B = \"1.2*n\" }, energy = \
             \"0.8*n_A*n + 0.6*n_B*n\" }\nB = { slopes = { n_A = \"1.2*n\", n_B = \"1.6*n\" } }";
        "energy": ValueKind::Formula, OPTIONAL,
            "With `slopes`: the reported energy of a particle, 0 if left out. The force is not its gradient."
            => "[excess_free_energy]\nA = { slopes = { n = \"1.6*n\" }, energy = \"0.7*n^2\" }";
    },
)
.titled("`SPECIES = { … }` in `[excess_free_energy]`");

const PAIR: Table = Table {
    forms: ("form", FORMS),
    ..Table::array(
        "pair",
        "A pair potential `phi(r)`, added to the many-body terms; a model may have any number of them. In a \
            model with interactions every two species need an interaction, through psi or a pair potential; \
            write strength 0 if they do not interact.",
        &joined::<{ PAIR_KEYS.len() + count(FORM_KEYS) }>(PAIR_KEYS, FORM_KEYS),
    )
};

const PAIR_KEYS: &[Key] = keys! {
    "between": ValueKind::Between, REQUIRED,
        "The two species."
        => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 25\nrange = 1.0";
    "form": ValueKind::Choice(|| FORMS.to_vec()), REQUIRED,
        "The form of the potential; the keys of each form describe it."
        => "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"spline\"\nstrength = 9.5\nA = 2\nB = 1\nrange_A = \
         0.8\nrange_B = 1.0";
};

const THERMOSTAT: Table = Table::array(
    "thermostat",
    "Dissipative and random forces of a pair of species, `-gamma w_R^2 (e.v) e` and \
     `sqrt(2 gamma kT) w_R xi dt^(-1/2) e` with `w_R = (1 - r/range)^exponent`. If any pair of species has one, \
     all must.",
    keys! {
        "between": ValueKind::Between, OPTIONAL,
            "The two species. If left out, the thermostat acts on every pair without a thermostat of its own."
            => "species = [\"A\", \"B\"]\n[[thermostat]]\ngamma = 4.5\nrange = 1.0\n[[thermostat]]\nbetween = \
             [\"A\", \"B\"]\ngamma = 9.0\nrange = 1.0";
        "gamma": ValueKind::NumberOrFormula, REQUIRED,
            "The drag, 0 or more."
            => "[[thermostat]]\ngamma = 4.5\nrange = 1.0";
        "range": ValueKind::NumberOrFormula, REQUIRED,
            "The distance at which the drag ends."
            => "[[thermostat]]\ngamma = 18.0\nrange = 0.75";
        "exponent": ValueKind::NumberOrFormula, OPTIONAL,
            "The exponent of `w_R`; 1 if left out."
            => "[[thermostat]]\ngamma = 4.5\nrange = 1.0\nexponent = 0.5";
    },
);

const LITERATURE: Table = Table::array(
    "literature",
    "Published values of the fluid, by temperature, each with its error. They do not affect a run; \
     `theory`, `run` and reports show them next to theory and measurements.",
    keys! {
        "kT": ValueKind::Positive, REQUIRED,
            "The temperature."
            => "[[literature]]\nkT = 1.0\ntension = [7.45, 0.04]";
        "density": ValueKind::Positive, OPTIONAL,
            "The number density that `pressure` belongs to."
            => "[[literature]]\nkT = 1.0\ndensity = 3.0\npressure = [23.65, 0.05]";
        "pressure": ValueKind::Measured, OPTIONAL,
            "Pressure of the homogeneous fluid at `density`."
            => "[[literature]]\nkT = 1.0\ndensity = 3.0\npressure = [23.65, 0.05]";
        "liquid": ValueKind::Measured, OPTIONAL,
            "Number density of the liquid in equilibrium with its vapour."
            => "[[literature]]\nkT = 1.0\nliquid = [6.05, 0.01]";
        "vapour": ValueKind::Measured, OPTIONAL,
            "Number density of the vapour."
            => "[[literature]]\nkT = 0.5\nvapour = [0.03, 0.01]";
        "tension": ValueKind::Measured, OPTIONAL,
            "Surface tension."
            => "[[literature]]\nkT = 1.0\ntension = [7.45, 0.04]";
        "width": ValueKind::Measured, OPTIONAL,
            "Width of the interface, `(rho_L - rho_V)/max|d rho/dz|`."
            => "[[literature]]\nkT = 1.0\nwidth = [0.66, 0.03]";
    },
);
