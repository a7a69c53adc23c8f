//! tropism in a browser: one WebAssembly module without imports, which answers the questions of the page of `web/`.
//!
//! In: a [`Question`] as JSON, with bytes after it. Out: JSON, with bytes after it. Long work is asked for in slices, so that a
//! worker can tell how far it is, and stop; how it is sliced, and among how many workers, does not change a bit of the results.
//!
//! Only bytes go in or out, so three exported functions do what wasm-bindgen and its command line would.

mod question;
mod beans;
mod evolution;
mod paper;
#[cfg(feature = "photographs")]
mod photographs;
#[cfg(feature = "photographs")]
mod measure;
#[cfg(feature = "photographs")]
mod tent;
mod session;

use std::cell::RefCell;

pub use question::{Answer, Question};
pub use session::{Session, SessionError};

/// What the module remembers from one question to the next.
#[derive(Default)]
struct Module {
    session: Session,
    /// Room for the next question; after it, its answer.
    bytes: Vec<u8>,
}

thread_local! {
    static MODULE: RefCell<Module> = RefCell::default();
}

/// Makes room for a question of `length` bytes, and says where: the caller writes it there.
#[allow(unsafe_code, reason = "a name that the page knows; nothing else has it")]
#[unsafe(no_mangle)]
pub extern "C" fn reserve(length: usize) -> *mut u8 {
    MODULE.with_borrow_mut(|module| {
        module.bytes = vec![0; length];
        module.bytes.as_mut_ptr()
    })
}

/// Answers the question that was written, and gives the length of the answer.
#[allow(unsafe_code, reason = "as above")]
#[unsafe(no_mangle)]
pub extern "C" fn ask() -> usize {
    MODULE.with_borrow_mut(|module| {
        let question = std::mem::take(&mut module.bytes);
        module.bytes = module.session.answer_bytes(&question);
        module.bytes.len()
    })
}

/// Where the answer begins.
#[allow(unsafe_code, reason = "as above")]
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    MODULE.with_borrow(|module| module.bytes.as_ptr())
}
