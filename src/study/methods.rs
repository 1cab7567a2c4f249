//! The methods under study.

use crate::recover::Method;

/// Every method, in the order of tables and legends.
pub(super) const METHODS: &[Method] = &[Method::Nnls];

/// The method that `recover` uses unless told otherwise.
pub(super) const DEFAULT: Method = Method::Nnls;

/// Whether `method` recovers each pixel on its own, and slowly: then a sample of them stands for
/// all. Otherwise pixels help each other, and all are recovered.
pub(super) fn judged_on_sample(method: Method) -> bool {
    match method {
        Method::Nnls => true,
    }
}
