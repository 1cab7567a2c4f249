//! Stopping where it is no longer wanted.

use super::RecoverError;
use crate::workers::Workers;

/// [`RecoverError::Stopped`] if `workers` are.
pub(super) fn go_on(workers: &impl Workers) -> Result<(), RecoverError> {
    match workers.stopped() {
        true => Err(RecoverError::Stopped),
        false => Ok(()),
    }
}
