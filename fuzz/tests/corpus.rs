//! The fuzzing corpus and mutations of it as an ordinary, bounded test: nothing may bring the readers
//! down, keep them busy, or eat memory.

use proptest::prelude::*;
use psidpd_fuzz_inputs::{
    c_api, checkpoint, checkpoint_of_a_run, coefficients, data, dump, expression, model, report, scene,
};
use rustix::time::{ClockId, clock_gettime};
use std::path::Path;
use std::time::Duration;

/// For each target: all together stay below 25 seconds of a processor.
const BUDGET: Duration = Duration::from_secs(2);

/// The longest that one text may take.
const PATIENCE: Duration = Duration::from_secs(5);

/// Processor time of this thread: other work on the machine does not count.
struct Begun(Duration);

impl Begun {
    fn now() -> Begun {
        Begun(Begun::time())
    }

    fn time() -> Duration {
        Duration::try_from(clock_gettime(ClockId::ThreadCPUTime)).expect("a clock that starts at 0")
    }

    fn elapsed(&self) -> Duration {
        Begun::time() - self.0
    }
}

fn corpus(folders: &[&str]) -> Vec<Vec<u8>> {
    let mut files: Vec<_> = folders
        .iter()
        .flat_map(|f| std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(f)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    assert!(files.len() > 2, "{folders:?}");
    files.iter().map(|f| std::fs::read(f).unwrap()).collect()
}

struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        // xorshift64* (Vigna 2016)
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % n.max(1)
    }
}

const TOKENS: &[&str] = &[
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    "[[",
    "]]",
    "\"",
    "\"\"\"",
    "'",
    "=",
    ",",
    ".",
    "|",
    "#",
    "\n",
    "^",
    "*",
    "/",
    "-",
    "+",
    "1e308",
    "-1",
    "0",
    "9223372036854775808",
    "nan",
    "inf",
    "0.0",
    "ln",
    "exp(",
    "min(",
    "n",
    "n_A",
    "rho",
    "kT",
    "pi",
    "\u{0}",
    "\u{fffd}",
    "²",
    "title",
    "species",
    "density",
    "pair",
    "kernel",
    "range",
    "bounds",
    "table",
    "pressure",
    "= \"/dev/zero\"",
    "= \".\"",
    "correction",
    "[0, 1]",
    "true",
];

/// One to eight changes: bytes, pieces taken out, repeated or from another text, tokens put in.
fn mutate(text: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut text = text.to_vec();
    for _ in 0..=random.below(8) {
        let at = random.below(text.len() + 1);
        let end = (at + random.below(40)).min(text.len());
        match random.below(7) {
            0 => {
                if let Some(byte) = text.get_mut(at) {
                    *byte ^= 1 << random.below(8);
                }
            }
            1 => {
                text.drain(at..end);
            }
            2 => {
                let piece = text[at..end].repeat(1 + random.below(20));
                text.splice(at..at, piece);
            }
            3 => {
                let from = random.below(other.len() + 1);
                let to = (from + random.below(200)).min(other.len());
                text.splice(at..at, other[from..to].iter().copied());
            }
            4 => {
                let token =
                    TOKENS[random.below(TOKENS.len())].repeat(1 + random.below(3) * random.below(100));
                text.splice(at..at, token.bytes());
            }
            5 => text.truncate(at),
            _ => {
                let token = TOKENS[random.below(TOKENS.len())];
                text.splice(at..end, token.bytes());
            }
        }
    }
    text
}

fn run(corpus: &[Vec<u8>], target: impl Fn(&[u8])) {
    let patiently = |bytes: &[u8]| {
        let start = Begun::now();
        target(bytes);
        let text = String::from_utf8_lossy(bytes);
        assert!(start.elapsed() < PATIENCE, "{:?} for\n{text}", start.elapsed());
    };
    corpus.iter().for_each(|text| patiently(text));
    let start = Begun::now();
    let mut random = Random(88_172_645_463_325_252);
    let mut tried = 0;
    while start.elapsed() < BUDGET && tried < 300_000 {
        let (one, other) = (&corpus[random.below(corpus.len())], &corpus[random.below(corpus.len())]);
        patiently(&mutate(one, other, &mut random));
        tried += 1;
    }
    assert!(tried > 200, "{tried}");
}

/// A target of texts.
fn texts(folders: &[&str], target: impl Fn(&str)) {
    run(&corpus(folders), |bytes| target(&String::from_utf8_lossy(bytes)));
}

#[test]
fn models() {
    texts(&["fuzz/corpus/model", "rust-core/tests/models/good", "rust-core/tests/models/bad"], model);
}

#[test]
fn expressions() {
    texts(&["fuzz/corpus/expression"], expression);
}

#[test]
fn scenes() {
    texts(&["fuzz/corpus/scene"], scene);
}

#[test]
fn data_files() {
    texts(&["fuzz/corpus/data"], data);
}

#[test]
fn dumps() {
    run(&corpus(&["fuzz/corpus/dump"]), dump);
}

#[test]
fn checkpoints() {
    run(&corpus(&["fuzz/corpus/checkpoint"]), |bytes| _ = checkpoint(bytes));
}

#[test]
fn folders_of_runs() {
    texts(&["fuzz/corpus/report"], report);
}

/// The checkpoints of the corpus are those of this version: with others nothing behind their first part would be tried.
/// PSIDPD_UPDATE_CORPUS=1 writes them anew.
#[test]
fn checkpoints_of_the_corpus_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/checkpoint");
    for (name, steps) in [("run1.bin", 1), ("run2.bin", 8), ("run3.bin", 20)] {
        let file = folder.join(name);
        if std::env::var_os("PSIDPD_UPDATE_CORPUS").is_some() {
            std::fs::write(&file, checkpoint_of_a_run(steps)).unwrap();
        }
        assert!(
            checkpoint(&std::fs::read(&file).unwrap()),
            "{name}: write it anew with PSIDPD_UPDATE_CORPUS=1"
        );
    }
}

#[test]
fn coefficients_of_styles() {
    run(&corpus(&["fuzz/corpus/coefficients"]), coefficients);
}

#[test]
fn calls_of_the_c_interface() {
    run(&corpus(&["fuzz/corpus/c_api"]), c_api);
}

/// Files that are valid TOML and long in one respect.
#[test]
fn long_files_take_no_long_time() {
    let head = "title = \"t\"\nspecies = [\"A\"]\n";
    let many = |start: &str, line: &dyn Fn(usize) -> String| {
        head.to_owned() + start + &(0..20_000).map(line).collect::<String>()
    };
    let texts = [
        many("[parameters]\n", &|k| format!("p{k} = \"p{}\"\n", k + 1)),
        many("[parameters]\n", &|k| format!("p{k} = {k}\n")),
        many("", &|k| format!("k{k} = {k}\n")),
        many("", &|k| format!("[density.d{k}]\nkernel = \"lucy\"\nrange = 1\n")),
        many("[excess_free_energy]\n", &|k| format!("s{k} = \"0\"\n")),
        many("", &|_| {
            "[[pair]]\nbetween = [\"A\", \"A\"]\nform = \"soft\"\nstrength = 1\nrange = 1\n".into()
        }),
        many("", &|_| "[[thermostat]]\ngamma = 1\nrange = 1\n".into()),
        format!(
            "{head}[density.n]\nkernel = \"lucy\"\nrange = 1\ncorrection = [{}]\n",
            "1, ".repeat(100_000)
        ),
        format!("title = \"t\"\nspecies = [{}]\n", "\"A\", ".repeat(100_000)),
    ];
    for text in texts {
        let start = Begun::now();
        model(&text);
        assert!(start.elapsed() < PATIENCE, "{:?} for {}", start.elapsed(), &text[..200]);
    }
}

proptest! {
    #[test]
    fn any_text_is_a_model_or_an_error(text in "\\PC{0,300}") {
        model(&text);
    }

    /// Values of any kind in a model that is right otherwise.
    #[test]
    fn any_value_is_right_or_an_error(key in 0..8usize, value in "([-+0-9.eE\\[\\]\"a-z{}=, ]{0,30}|\"[-+*/^()n.0-9a-z ]{0,60}\")") {
        let mut values = ["3", "[\"A\"]", "\"lucy\"", "1", "[1, 2]", "\"n^2\"", "0", "1"].map(str::to_owned);
        values[key] = value;
        let [dimensions, species, kernel, range, bounds, psi, strength, gamma] = values;
        model(&format!(
            "title = \"t\"\ndimensions = {dimensions}\nspecies = {species}\n[density.n]\nkernel = {kernel}\n\
             range = {range}\nbounds = {bounds}\n[excess_free_energy]\nA = {psi}\n[[pair]]\n\
             between = [\"A\", \"A\"]\nform = \"soft\"\nstrength = {strength}\nrange = 1\n[[thermostat]]\n\
             gamma = {gamma}\nrange = 1\n"
        ));
    }
}
