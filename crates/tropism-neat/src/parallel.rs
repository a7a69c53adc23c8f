//! Maps over numbers from 0 on: on rayon's thread pool with the feature `rayon`, otherwise on the calling thread.
//!
//! This is the only module that knows threads. The order of the results is that of the numbers either way.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Does the work of each number. Not generic: what rayon needs is compiled once.
#[cfg(feature = "rayon")]
fn for_each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    use rayon::prelude::*;
    // Works are long and few: each is a piece of its own.
    (0..count).into_par_iter().with_max_len(1).for_each(work);
}

/// Does the work of each number.
#[cfg(not(feature = "rayon"))]
fn for_each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).for_each(work);
}

/// What `work` makes of each number below `count`, in order.
///
/// ```
/// assert_eq!(tropism_neat::parallel::map(4, |number| number * number), [0, 1, 4, 9]);
/// ```
pub fn map<R: Send>(count: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let results: Vec<Mutex<Option<R>>> = (0..count).map(|_| Mutex::new(None)).collect();
    for_each(count, &|number| {
        let result = work(number);
        *results[number].lock().expect("nothing fails under the lock") = Some(result);
    });
    let result = |slot: Mutex<Option<R>>| slot.into_inner().expect("nothing fails under the lock");
    results.into_iter().filter_map(result).collect()
}

/// What `work` makes of each number below `count`, in order.
///
/// # Errors
/// Of those that `work` returned, the one of the least number. After an error no further work begins.
pub fn try_map<R: Send, E: Send>(
    count: usize,
    work: impl Fn(usize) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let failed = AtomicBool::new(false);
    let results = map(count, |number| {
        (!failed.load(Ordering::Relaxed))
            .then(|| work(number).inspect_err(|_| failed.store(true, Ordering::Relaxed)))
    });
    results.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_that_of_the_numbers() {
        assert_eq!(map(1000, |number| 3 * number), (0..1000).map(|number| 3 * number).collect::<Vec<_>>());
        assert!(map(0, |number| number).is_empty());
        let halves = try_map(1000, |number| Ok::<usize, String>(number / 2));
        assert_eq!(halves, Ok((0..1000).map(|number| number / 2).collect()));
    }

    #[test]
    fn after_an_error_no_work_begins() {
        let begun = std::sync::atomic::AtomicUsize::new(0);
        let all = try_map(100_000, |number| {
            begun.fetch_add(1, Ordering::Relaxed);
            if number % 10 == 7 { Err(number) } else { Ok(()) }
        });
        assert!(all.is_err_and(|number| number % 10 == 7));
        assert!(begun.into_inner() < 100_000);
    }
}
