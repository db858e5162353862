//! Observables: read, never drive.
