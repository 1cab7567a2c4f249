//! The widest vector instructions that the machine has.

/// Runs `work` compiled for the widest vector instructions at hand. It must be `#[inline(always)]`, and
/// so must what it calls, to be compiled along with it. None of them fuses a multiplication with an
/// addition, so that every machine, WebAssembly too, gets the same bits.
#[inline(always)]
pub fn vectorised<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        /// `work` itself, for machines with AVX2.
        #[target_feature(enable = "avx2")]
        fn avx2<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the machine has AVX2, as was just asked.
            return unsafe { avx2(work) };
        }
    }
    work()
}
