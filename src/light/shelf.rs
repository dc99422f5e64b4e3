//! What is computed once for a design and kept for its next scene.

use std::sync::{Arc, Mutex, PoisonError};

/// Designs and choices that are kept; the oldest goes first.
const KEPT: usize = 24;

/// Things by a text that tells all that they depend on. What is kept never changes what comes out, only when it is
/// computed.
pub struct Shelf<T>(Mutex<Vec<(String, Arc<T>)>>);

impl<T: Default> Default for Shelf<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Default> Shelf<T> {
    /// An empty shelf.
    pub const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// The thing of a text; a new one where there is none.
    pub fn get(&self, key: &str) -> Arc<T> {
        // A thread that died while it held the shelf left it whole: entries are pushed and removed in one step.
        let mut shelf = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = shelf.iter().find(|(kept, _)| kept == key) {
            return Arc::clone(found);
        }
        if shelf.len() >= KEPT {
            shelf.remove(0);
        }
        let new = Arc::new(T::default());
        shelf.push((key.to_owned(), Arc::clone(&new)));
        new
    }
}
