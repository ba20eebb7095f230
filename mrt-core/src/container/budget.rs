//! How much a reader may allocate.

use super::error::ContainerError;

/// The number of bytes that a reader may still allocate.
#[derive(Clone, Debug)]
pub struct ByteBudget {
    remaining: u64,
}

impl ByteBudget {
    /// A budget of the given number of bytes.
    pub fn new(bytes: u64) -> Self {
        Self { remaining: bytes }
    }

    /// Bytes that are left.
    pub fn remaining(&self) -> u64 {
        self.remaining
    }

    /// Takes `bytes` for `what`; call it before allocating.
    ///
    /// # Errors
    /// [`ContainerError::LimitExceeded`] if fewer are left; the budget then stays as it was.
    pub fn spend(&mut self, what: &'static str, bytes: u64) -> Result<(), ContainerError> {
        match self.remaining.checked_sub(bytes) {
            Some(remaining) => {
                self.remaining = remaining;
                Ok(())
            }
            None => Err(ContainerError::LimitExceeded {
                what,
                limit: self.remaining,
                found: bytes,
            }),
        }
    }
}
