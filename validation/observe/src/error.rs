/// Why values cannot be averaged, or observables restored.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObserveError {
    #[error("{found} samples, but an error bar needs at least {least}")]
    TooFew { found: usize, least: usize },
    #[error("sample {index} is not a finite number")]
    NonFinite { index: usize },
    #[error("the samples are too large to be averaged")]
    Overflow,
    #[error("{times} times but {values} values")]
    Times { times: usize, values: usize },
    #[error("time {index} is not a finite number later than the previous one")]
    Time { index: usize },
    #[error("the pressure components differ in length: {xx} xx, {yy} yy, {zz} zz")]
    Pressures { xx: usize, yy: usize, zz: usize },
    #[error("the box length {0} along z is not a positive number")]
    BoxLength(f64),
    #[error("box length {length} and area {area} must be positive numbers")]
    Box { length: f64, area: f64 },
    #[error("{found} bins; a profile has between 1 and {most}")]
    Bins { found: usize, most: usize },
    #[error("coordinate {index} of the frame is not a finite number")]
    Coordinate { index: usize },
    #[error("the frame has no slab to be centred on")]
    NoSlab,
    #[error("no frames")]
    NoFrames,
    /// Bytes that are not the output of [`Observers::to_bytes`](super::Observers::to_bytes).
    #[error(transparent)]
    Bytes(#[from] postcard::Error),
    /// The bytes belong to another list of observables or to other settings.
    #[error("the observables are not those of the scene")]
    OtherObservables,
}
