//! The widest vectors that this processor has, chosen when the program runs; the only `unsafe` of the workspace.
//!
//! What is compiled for them gives the same bits as what is not: nothing is fused or summed in another order.

/// Work that is compiled for several processors.
pub(crate) trait Work {
    /// What comes of it.
    type Result;

    /// Does it. Must be `#[inline(always)]`, and so must what it calls: only what is inlined is compiled for the processor
    /// (and a closure, which cannot be marked so, is inlined if it is small).
    fn work(self) -> Self::Result;
}

/// Does `work` with the widest vectors of this processor.
#[allow(
    unsafe_code,
    reason = "calling a function that is compiled for a processor which was found to be here"
)]
pub(crate) fn widest<W: Work>(work: W) -> W::Result {
    #[cfg(target_arch = "x86_64")]
    {
        let has_avx512 = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw");
        if has_avx512 {
            // SAFETY: the processor has the features that the function is compiled for.
            return unsafe { with_avx512(work) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { with_avx2(work) };
        }
    }
    work.work()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw")]
fn with_avx512<W: Work>(work: W) -> W::Result {
    work.work()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<W: Work>(work: W) -> W::Result {
    work.work()
}
