//! Compiles code for the widest vector instructions of the machine.

/// Runs `work`, compiled for AVX2 where the machine has it.
///
/// There `work` must be `#[inline(always)]`, and so must all that it calls: only inlined code is compiled for the wider
/// instructions. Elsewhere the compiler chooses: in WebAssembly, its choice is smaller, and a tenth faster.
///
/// FMA stays off, so results have the same bits on every machine.
#[inline(always)]
pub(crate) fn vectorise<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the line above has found AVX2 on this machine.
            return unsafe { with_avx2(work) };
        }
    }
    work()
}
