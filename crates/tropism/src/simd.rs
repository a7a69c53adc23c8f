//! Run-time dispatch to the widest vectors of this processor; the only `unsafe` of the workspace.
//!
//! The variants give the same bits as the plain code: nothing is fused, and no sum is reordered.

/// A piece of work that is compiled for several instruction sets.
pub(crate) trait Kernel {
    /// The result.
    type Result;

    /// Runs the kernel. Must be `#[inline(always)]`, and so must what it calls: only what is inlined is compiled for the
    /// instruction set (a closure cannot be marked so, and is inlined if it is small).
    fn run(self) -> Self::Result;
}

/// Runs `kernel` with the widest vectors of this processor: AVX-512, AVX2 or the compiler's baseline.
#[allow(
    unsafe_code,
    reason = "calling a function that is compiled for an instruction set which was detected at run time"
)]
pub(crate) fn dispatch<K: Kernel>(kernel: K) -> K::Result {
    #[cfg(target_arch = "x86_64")]
    {
        let has_avx512 = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw");
        if has_avx512 {
            // SAFETY: the processor has the features that the function is compiled for.
            return unsafe { with_avx512(kernel) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { with_avx2(kernel) };
        }
    }
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw")]
fn with_avx512<K: Kernel>(kernel: K) -> K::Result {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<K: Kernel>(kernel: K) -> K::Result {
    kernel.run()
}
