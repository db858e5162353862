//! The pair styles that are replaced.

/// Words among the arguments of pair styles that are no styles.
const SETTINGS: [&str; 26] = [
    "yes",
    "no",
    "mid",
    "min",
    "exclude",
    "bptype",
    "linear",
    "spline",
    "lookup",
    "bitmap",
    "ewald",
    "pppm",
    "msm",
    "off",
    "on",
    "shift",
    "long",
    "cut",
    "law",
    "lucy",
    "mixed",
    "double",
    "precision",
    "threads",
    "max",
    "conservative",
];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sort {
    /// `mdpd` and `mdpd/rhosum`.
    Mdpd,
    /// `mdpd/diffcut`, whose drag has a range of its own, and `mdpd/rhosum`.
    Diffcut,
    /// `dpd`.
    Dpd,
}

/// Where a pair style has the styles that are replaced.
#[derive(Debug, Clone)]
pub struct Old {
    pub sort: Sort,
    pub hybrid: bool,
    /// Names of the styles, as written.
    pub names: Vec<String>,
    /// Names of all sub-styles of a hybrid.
    pub styles: Vec<String>,
    /// The number of the first word of theirs, and the numbers of all.
    pub first: usize,
    pub gone: Vec<usize>,
    /// The numbers of temperature, cut-off and seed.
    pub arguments: Vec<usize>,
    pub cutoff: String,
    /// Whether forces stood before densities.
    pub forces_first: bool,
    pub remarks: Vec<&'static str>,
}

/// The name of a style without the suffix of an accelerated variant.
pub fn base(style: &str) -> &str {
    let mut name = style;
    for suffix in ["/device", "/host", "/kk", "/gpu", "/omp", "/opt", "/intel"] {
        name = name.strip_suffix(suffix).unwrap_or(name);
    }
    if ["mdpd", "mdpd/rhosum", "mdpd/diffcut", "dpd", "mvv/dpd"].contains(&name) { name } else { style }
}

impl Old {
    /// Finds the style in the words after `pair_style`; the error says why it cannot be replaced.
    pub fn find(style: &[&str]) -> Result<Option<Old>, &'static str> {
        let Some(first) = style.first() else { return Ok(None) };
        let hybrid = base(first) == *first && first.starts_with("hybrid");
        let from = usize::from(hybrid);
        let is_style = |word: &str| word.starts_with(char::is_alphabetic) && !SETTINGS.contains(&word);
        let begins: Vec<usize> = (from..style.len()).filter(|k| is_style(style[*k])).collect();
        let all = |name: &str| begins.iter().copied().filter(|k| base(style[*k]) == name).collect::<Vec<_>>();
        let (densities, mdpd, diffcut, dpd) =
            (all("mdpd/rhosum"), all("mdpd"), all("mdpd/diffcut"), all("dpd"));
        let (sort, forces) = match (mdpd.as_slice(), diffcut.as_slice(), dpd.as_slice()) {
            ([], [], []) if densities.is_empty() => return Ok(None),
            ([], [], []) => return Err("mdpd and mdpd/rhosum belong together: one of them is missing"),
            ([at], [], _) => (Sort::Mdpd, *at),
            ([], [at], _) => (Sort::Diffcut, *at),
            ([], [], [at]) => (Sort::Dpd, *at),
            _ => return Err("the style occurs several times in this hybrid, which mdpd/psi replaces once"),
        };
        if sort != Sort::Dpd && densities.len() != 1 {
            return Err("mdpd and mdpd/rhosum belong together: one of them is missing");
        }
        // Arguments reach to the next style.
        let end = begins.iter().copied().find(|k| *k > forces).unwrap_or(style.len());
        if end < forces + 4 {
            return Err("the style needs a temperature, a cut-off and a seed");
        }
        let mut remarks = vec![];
        if end > forces + 4 {
            remarks.push("the arguments after the seed are left out");
        }
        let densities = densities.first().copied().filter(|_| sort != Sort::Dpd);
        let gone: Vec<usize> = densities.into_iter().chain(forces..end).collect();
        Ok(Some(Old {
            sort,
            hybrid,
            names: densities.into_iter().chain([forces]).map(|k| style[k].to_owned()).collect(),
            styles: begins.iter().map(|k| style[*k].to_owned()).collect(),
            first: gone.iter().copied().min().unwrap_or(forces),
            gone,
            arguments: (forces + 1..forces + 4).collect(),
            cutoff: style[forces + 2].to_owned(),
            forces_first: densities.is_some_and(|k| forces < k),
            remarks,
        }))
    }
}
