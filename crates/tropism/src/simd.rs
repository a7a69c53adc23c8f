//! Run-time dispatch to the widest vectors of this processor; the only `unsafe` of the workspace.
//!
//! The variants give the same bits as the plain code: nothing is fused, and no sum is reordered.

/// A piece of work that is compiled for several instruction sets.
pub trait Kernel {
    /// The result.
    type Result;

    /// Runs the kernel. Must be `#[inline(always)]`, and so must what it calls: only what is inlined is compiled for the
    /// instruction set (a closure cannot be marked so, and is inlined if it is small).
    fn run(self) -> Self::Result;
}

/// The instruction sets for which batches of simulations are compiled. AVX-512 made them no faster, rods a seventh slower.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VectorUnit {
    /// AVX2 of x86-64: 256 bits.
    Avx2,
    /// What every processor of this architecture has.
    Baseline,
}

impl VectorUnit {
    /// The widest of this processor. Results do not depend on it.
    #[must_use]
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            return Self::Avx2;
        }
        Self::Baseline
    }
}

impl std::fmt::Display for VectorUnit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Avx2 => "AVX2",
            Self::Baseline => "baseline vectors",
        })
    }
}

/// Runs `kernel` with the widest vectors of this processor.
#[allow(
    unsafe_code,
    reason = "calling a function that is compiled for an instruction set which was detected at run time"
)]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Result {
    match VectorUnit::detect() {
        // SAFETY: the processor has the feature that the function is compiled for.
        #[cfg(target_arch = "x86_64")]
        VectorUnit::Avx2 => unsafe { with_avx2(kernel) },
        _ => kernel.run(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<K: Kernel>(kernel: K) -> K::Result {
    kernel.run()
}
