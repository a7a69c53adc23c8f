//! Maps over slices in order: on rayon's thread pool with the feature `rayon`, otherwise on the calling thread.
//!
//! This is the only module that knows threads. The result is the same either way.

#[cfg(feature = "rayon")]
use rayon::prelude::*;

/// Applies `f` to the index and the value of each item and collects the results in order.
#[cfg(feature = "rayon")]
pub(crate) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    items.par_iter().enumerate().map(|(index, item)| f(index, item)).collect()
}

/// Applies `f` to the index and the value of each item and collects the results in order.
#[cfg(not(feature = "rayon"))]
pub(crate) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    items.iter().enumerate().map(|(index, item)| f(index, item)).collect()
}

/// Applies `f` to each item and collects the results in order; stops at an error and returns it.
#[cfg(feature = "rayon")]
pub(crate) fn try_map<T: Sync, R: Send, E: Send>(
    items: &[T],
    f: impl Fn(&T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    items.par_iter().map(&f).collect()
}

/// Applies `f` to each item and collects the results in order; stops at an error and returns it.
#[cfg(not(feature = "rayon"))]
pub(crate) fn try_map<T: Sync, R: Send, E: Send>(
    items: &[T],
    f: impl Fn(&T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    items.iter().map(f).collect()
}
