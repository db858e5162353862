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
    #[error("the frame has no slab to be centred on, or a coordinate that is not finite")]
    NoSlab,
    /// Bytes that are not the output of [`Observers::to_bytes`](super::Observers::to_bytes).
    #[error(transparent)]
    Bytes(#[from] postcard::Error),
    /// The bytes belong to another list of observables or to other settings.
    #[error("the observables are not those of the scene")]
    OtherObservables,
}
