//! Tables of all keys of `[observe]`. They are the source of the reference `docs/observables.md`, and other
//! keys are refused.

pub use psidpd_core::document::keys::{Key, Need, Table, ValueKind, key};

/// Declares keys in short, as the macro of models does. Constants go before a key: `use AXIS;`.
macro_rules! keys {
    ($($(use $shared:ident;)* $name:literal: $value:expr, $need:expr, $about:expr => $example:expr;)*$(then $last:ident;)?) => {
        &[$($($shared,)* $crate::keys::key($name, $value, $need, $about, $example),)* $($last)?]
    };
}
pub(crate) use keys;

/// A table without keys, of which a file has one.
pub const PLAIN: Table = Table { path: "", title: "", array: false, about: "", forms: ("", &[]), keys: &[] };

/// The keys of `[observe]` for every observable, and the keys that each observable has in addition.
pub const COMMON: &[Key] = keys! {
    "every": ValueKind::Words("whole number from 1"), Need::Default("10"),
        "Steps between samples: those whose number is a multiple of it."
        => "5";
    "stages": ValueKind::Words("array of names of stages"), Need::Default("the last stage"),
        "In which stages to sample. Each has its own result."
        => "[\"produce\"]";
    "skip": ValueKind::Words("whole number from 0"), Need::Default("0"),
        "Steps at the beginning of a stage that are not sampled."
        => "20";
};

pub(super) const AXIS: Key = key(
    "axis",
    ValueKind::Words("`\"x\"`, `\"y\"` or `\"z\"`"),
    Need::Default("the normal of the initial slab, or else the last direction"),
    "The direction of the profile, normal to the faces of the box there.",
    "\"x\"",
);

pub(super) const BINS: Key = key(
    "bins",
    ValueKind::Words("whole number from 1 to 10000"),
    Need::Default("as many as make them 0.1 wide, or a little less"),
    "Bins along the axis.",
    "50",
);

pub(super) const RECENTRE: Key = key(
    "recentre",
    ValueKind::Words("true, false, or the name of a species"),
    Need::Default("true if the scene starts from a slab normal to the axis, else false"),
    "Whether each sample is shifted so that the centre of mass of all particles, or of those of one species, taken on \
            the circle, is at 0: a slab that drifts, or a layer in a mixture that fills the box, is not smeared then.",
    "true",
);

/// The reference of `[observe]` as Markdown.
pub fn reference(tables: &[&Table]) -> String {
    let mut out = String::from(INTRODUCTION);
    out.push_str("\n## Keys of every observable\n\n");
    list(&mut out, COMMON);
    for table in tables {
        out.push_str(&format!("\n## `{}`: {}\n\n{}\n", table.path, table.title, table.about));
        if !table.keys.is_empty() {
            out.push('\n');
            list(&mut out, table.keys);
        }
    }
    out
}

fn list(out: &mut String, keys: &[Key]) {
    out.push_str("| key | value | if left out | meaning |\n|---|---|---|---|\n");
    for key in keys {
        // A vertical bar would end the cell.
        let [value, default, about] =
            [&key.value.describe(), key.default(), key.about].map(|text| text.replace('|', "\\|"));
        out.push_str(&format!("| `{}` | {value} | {default} | {about} |\n", key.name));
    }
}

const INTRODUCTION: &str = r#"# Observables

What `[observe]` in a scene may ask for. Nothing is measured that is not asked for.

```toml
[observe]
every  = 10                    # for every observable that does not say otherwise
stages = ["produce"]

rdf         = true             # with defaults
temperature = true

[observe.surface_tension]      # with settings
axis  = "z"
every = 20
```

A run writes what it measured to `observables.json` and, one file each, to `observables/NAME.csv`
(`NAME-STAGE.csv` if several stages have it). The JSON file is a list of objects

```js
{ "name", "title", "stage", "kind": "scalar" | "profile" | "curve" | "series" | "field",
  "x": { "name", "unit", "values" } or null,
  "columns": [ { "name", "unit", "values", "errors" } ],
  "samples", "note" }
```

A `scalar` has one value in each column and no `x`; the first columns of a `field` are the coordinates of its
points. `null` stands for a value, or an error, that does not exist: a temperature where no particle came, the
error of a single sample.

**Error bars** are one standard deviation. Samples that follow each other are correlated; the error of a mean is that of
autoregressions of all orders, weighted by the corrected information criterion of Akaike (Burg's recursion), so
that series which swing, as pressures do, have no larger errors than they should; averaged over blocks of 1 to 16 samples, so that slow
modes with a small share of the variance are seen. A quotient of means R = ⟨a⟩/⟨b⟩ has the
error of the mean of (a − R b)/⟨b⟩. Parameters of fits to a mean profile have jackknife errors: the means are moved towards those of each of
20 to 40 stretches of the run, by about their own deviation, and what that changes is a series like any other. Long
series are kept as 256 to 511 block means (hanging drops 32 to 63, viscosities 64 to 127), so memory does not grow with the run; at the end the last block, if
it is not complete, is left out. With fewer than 8 samples the error is the plain standard error.

How large they should have been shows the spread of results over seeds. In 64 runs each of a liquid, a mixture, a slab, a drop, a flow and a
hanging drop, 3000 to 5000 steps long, spread over error was within 0.8 to 1.25 for 153 of 161 columns, profiles pooled over their bins;
such a ratio is itself known to 9 %. Slowest to be seen were velocities in bins, 1.20 after 24 relaxation times. Errors
are too large where a mean is nearly that of a time derivative (shear stress across a slab, 0.72) and where the value is the size of the
noise (`deviation` of `poiseuille`, 0.73, and `residual` of `pendant`, 0.53; 0.71 in theory). A mode that is slower than the run is long
cannot be seen in it, and what differs from the start, such as a support of particles at random, never shows. Repeat it by
`cargo test --release -p psidpd --test coverage -- --ignored --nocapture`.

**What a sample costs**, in steps of the run: of Warren's set 6, 6050 particles on one thread in mixed precision, `density_profile`,
`density_field`, `interface_width` and `msd` one or less, `pressure`, `clusters` and `viscosity` 4, `energy` 6, `structure_factor` 7,
`local_density` 9, `temperature` 10 (these two, `energy` and `pressure` together 18, since they share an evaluation), `surface_tension` 20,
`stress_profile` 26, `rdf` up to half the box 37. They are computed in double precision; `rdf` and `structure_factor` share the
threads of the run. With samples at every tenth step such observables take most of a run. Samples that are closer than the quantity
changes tell little more: where `every = 50` serves as well, a run with `temperature` and `rdf` is three times as fast.

**Units** are those of the model: lengths in its unit of length ("length"), energies in the unit of kT, masses in m; "1" stands for a pure
number. In two dimensions volumes are areas: densities count per length², pressures are forces per length, surface
tensions are line tensions. Forces are those of the Hamiltonian, many-body terms included; drag and noise take
part only where it says so.

This page is written from the tables of keys in `validation/observe/src/`.
"#;
