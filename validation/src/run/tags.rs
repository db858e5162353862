use std::ops::RangeInclusive;

/// A set of particles, by their tags.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Tags {
    /// Every particle.
    #[default]
    All,
    /// Those of these ranges.
    Ranges(Vec<RangeInclusive<i32>>),
}

impl Tags {
    /// No particle.
    pub fn none() -> Tags {
        Tags::Ranges(Vec::new())
    }

    /// Whether a tag is in the set.
    pub fn contain(&self, tag: i32) -> bool {
        match self {
            Tags::All => true,
            Tags::Ranges(ranges) => ranges.iter().any(|r| r.contains(&tag)),
        }
    }

    /// Whether no tag can be in the set.
    pub fn is_empty(&self) -> bool {
        matches!(self, Tags::Ranges(ranges) if ranges.iter().all(RangeInclusive::is_empty))
    }
}
