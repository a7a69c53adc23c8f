//! Bounds on numbers, chosen so that sums stay finite and counters never overflow.
//!
//! All of them are far above what evolution reaches. They matter for files, which may hold anything.

/// Largest magnitude of a weight, slope or shift in a genome. Chosen: far beyond all that evolution reaches.
pub const WEIGHT_LIMIT: f64 = 1e6;

/// Largest number of inputs, of outputs, and of links in a minimal genome. Chosen: some megabytes.
pub const SIZE_LIMIT: usize = 100_000;

/// Largest magnitude of a score: the sum of a million of them is finite.
pub const SCORE_LIMIT: f64 = 1e150;

/// Largest magnitude of a number in a behaviour descriptor: distances between descriptors stay below [`SCORE_LIMIT`].
pub const DESCRIPTOR_LIMIT: f64 = 1e70;

/// Ids and innovation numbers in files stay below this, so that later increments do not overflow.
pub(crate) const ID_LIMIT: u32 = 1 << 31;
