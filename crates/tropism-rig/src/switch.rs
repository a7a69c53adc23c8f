//! What is on or off: a lamp, a relay, a plug.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use tropism::lamps::Light;
use tropism::rig::{Flash, Lamps, RigError};

/// A device that is on or off.
pub trait Switch: Send {
    /// Switches it, and returns once the device has confirmed, as far as it can.
    ///
    /// # Errors
    /// [`RigError::Device`] if it does not obey; then its state is unknown.
    fn switch(&mut self, is_on: bool) -> Result<(), RigError>;
}

impl<T: Switch + ?Sized> Switch for Box<T> {
    fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
        (**self).switch(is_on)
    }
}

/// Two lamps of which at most one is lit: the other is dark, and has said so, before one is lit.
#[derive(Debug)]
pub struct Interlock<L, R> {
    left: L,
    right: R,
    /// Between dark and lit.
    pause: Duration,
    /// Which lamps are known to be dark.
    is_dark: [bool; 2],
}

impl<L: Switch, R: Switch> Interlock<L, R> {
    /// Two lamps in an unknown state, with `pause` between the darkness of one and the light of the other.
    pub const fn new(left: L, right: R, pause: Duration) -> Self {
        Self { left, right, pause, is_dark: [false; 2] }
    }

    fn switch(&mut self, light: Light, is_on: bool) -> Result<(), RigError> {
        let slot = &mut self.is_dark[usize::from(light == Light::RIGHT)];
        // Unknown until the device has confirmed.
        *slot = false;
        match light {
            Light::LEFT => self.left.switch(is_on)?,
            _ => self.right.switch(is_on)?,
        }
        *slot = !is_on;
        Ok(())
    }
}

impl<L: Switch, R: Switch> Lamps for Interlock<L, R> {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        let Some(light) = light else {
            // The second one is tried even if the first does not obey.
            let (left, right) = (self.switch(Light::LEFT, false), self.switch(Light::RIGHT, false));
            return left.and(right);
        };
        let other = if light == Light::LEFT { Light::RIGHT } else { Light::LEFT };
        let was_dark = self.is_dark[usize::from(other == Light::RIGHT)];
        // Every time, even if it was dark already: a device that restarted may have forgotten.
        self.switch(other, false)?;
        if !was_dark {
            thread::sleep(self.pause);
        }
        self.switch(light, true)
    }
}

/// A flash that is never on for longer than a bound, whatever happens to the program that asked for it, short of its
/// death.
///
/// A thread of its own puts the flash off when the bound has passed, and keeps trying if the device does not obey.
/// Against death there are the device's own timers, see docs/rig.md.
pub struct BoundedFlash {
    shared: Arc<(Mutex<State>, Condvar)>,
    settle: Duration,
    max_on: Duration,
    guard: Option<JoinHandle<()>>,
}

struct State {
    switch: Box<dyn Switch>,
    /// When the guard puts it off; `None` if it has confirmed to be off.
    off_at: Option<Instant>,
    is_over: bool,
}

/// How long the guard waits before it tries again.
const AGAIN: Duration = Duration::from_secs(1);

impl BoundedFlash {
    /// A flash with `settle` between on and the photograph, and on for at most `max_on`.
    ///
    /// # Errors
    /// If it cannot be put off at the beginning.
    pub fn new(mut switch: Box<dyn Switch>, settle: Duration, max_on: Duration) -> Result<Self, RigError> {
        switch.switch(false)?;
        let state = State { switch, off_at: None, is_over: false };
        let shared = Arc::new((Mutex::new(state), Condvar::new()));
        let guarded = Arc::clone(&shared);
        let guard = Some(thread::spawn(move || guard(&guarded)));
        Ok(Self { shared, settle, max_on, guard })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.shared.0)
    }
}

/// What is inside even if a driver panicked while it held it: a flash that can be put off should be.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn guard((state, changed): &(Mutex<State>, Condvar)) {
    let mut state = lock(state);
    loop {
        match state.off_at {
            Some(off_at) if state.is_over || off_at <= Instant::now() => {
                state.off_at = state.switch.switch(false).is_err().then(|| Instant::now() + AGAIN);
                if state.is_over {
                    return;
                }
            }
            None if state.is_over => return,
            Some(off_at) => {
                let left = off_at.saturating_duration_since(Instant::now());
                state = changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
            }
            None => state = changed.wait(state).unwrap_or_else(PoisonError::into_inner),
        }
    }
}

impl Flash for BoundedFlash {
    fn flash(&mut self, is_on: bool) -> Result<(), RigError> {
        let mut state = self.state();
        // The guard is told first: what the device does with a command that failed is unknown.
        state.off_at = Some(Instant::now() + self.max_on);
        let done = state.switch.switch(is_on);
        match (&done, is_on) {
            (Ok(()), true) => {}
            (Ok(()), false) => state.off_at = None,
            (Err(_), _) => state.off_at = Some(Instant::now()),
        }
        drop(state);
        self.shared.1.notify_all();
        done?;
        if is_on {
            thread::sleep(self.settle);
        }
        Ok(())
    }
}

impl Drop for BoundedFlash {
    fn drop(&mut self) {
        self.state().is_over = true;
        self.shared.1.notify_all();
        if let Some(guard) = self.guard.take() {
            // A guard that panicked has said so; nothing is left to do here.
            let _ = guard.join();
        }
    }
}

/// No flash: the tent is bright enough, or the camera has its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoFlash;

impl Flash for NoFlash {
    fn flash(&mut self, _is_on: bool) -> Result<(), RigError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::wait_until;

    /// What happened to the lamps of a tent: which were lit after each command, and which commands fail.
    #[derive(Default)]
    struct Tent {
        is_lit: [bool; 2],
        most_lit: usize,
        commands: Vec<(usize, bool)>,
        failing: Vec<bool>,
    }

    struct TentLamp {
        tent: Arc<Mutex<Tent>>,
        slot: usize,
    }

    impl Switch for TentLamp {
        fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
            let mut tent = lock(&self.tent);
            if tent.failing.pop().unwrap_or(false) {
                return Err(crate::failed("lamp", "found silence, wanted a confirmation"));
            }
            tent.is_lit[self.slot] = is_on;
            tent.commands.push((self.slot, is_on));
            tent.most_lit = tent.most_lit.max(tent.is_lit.iter().filter(|&&is_lit| is_lit).count());
            Ok(())
        }
    }

    fn lamps(failing: Vec<bool>) -> (Arc<Mutex<Tent>>, Interlock<TentLamp, TentLamp>) {
        let tent = Arc::new(Mutex::new(Tent { failing, ..Tent::default() }));
        let lamp = |slot| TentLamp { tent: Arc::clone(&tent), slot };
        (Arc::clone(&tent), Interlock::new(lamp(0), lamp(1), Duration::ZERO))
    }

    proptest! {
        #[test]
        fn two_lamps_are_never_lit_whatever_fails(
            lights in proptest::collection::vec(proptest::option::of(any::<bool>()), 1..40),
            failing in proptest::collection::vec(proptest::bool::weighted(0.3), 0..60),
        ) {
            let (tent, mut lamps) = lamps(failing);
            for light in lights {
                let light = light.map(|is_left| if is_left { Light::LEFT } else { Light::RIGHT });
                let done = lamps.light(light);
                let tent = lock(&tent);
                if done.is_ok() {
                    let lit = Light::BOTH.map(|side| light == Some(side));
                    prop_assert_eq!(tent.is_lit, lit);
                }
                prop_assert!(tent.most_lit <= 1);
            }
        }
    }

    #[test]
    fn one_goes_dark_before_the_other_is_lit_and_both_are_darkened_even_if_one_does_not_obey() {
        let (tent, mut both) = lamps(vec![]);
        both.light(Some(Light::RIGHT)).unwrap();
        both.light(Some(Light::LEFT)).unwrap();
        assert_eq!(lock(&tent).commands, [(0, false), (1, true), (1, false), (0, true)]);
        let (tent, mut both) = lamps(vec![true]);
        assert!(both.light(None).is_err());
        assert_eq!(lock(&tent).commands, [(1, false)]);
    }

    /// A bulb that obeys only so many commands, then again when it is told to.
    struct Bulb {
        is_on: Arc<Mutex<bool>>,
        deaf_for: Arc<Mutex<usize>>,
    }

    impl Switch for Bulb {
        fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
            let mut deaf_for = self.deaf_for.lock().unwrap();
            if *deaf_for > 0 {
                *deaf_for -= 1;
                return Err(crate::failed("flash", "deaf"));
            }
            *self.is_on.lock().unwrap() = is_on;
            Ok(())
        }
    }

    fn bulb(max_on: Duration) -> (Arc<Mutex<bool>>, Arc<Mutex<usize>>, BoundedFlash) {
        let (is_on, deaf_for) = (Arc::new(Mutex::new(true)), Arc::new(Mutex::new(0)));
        let bulb = Bulb { is_on: Arc::clone(&is_on), deaf_for: Arc::clone(&deaf_for) };
        let flash = BoundedFlash::new(Box::new(bulb), Duration::ZERO, max_on).unwrap();
        (is_on, deaf_for, flash)
    }

    fn wait_for_dark(is_on: &Mutex<bool>) {
        wait_until(|| !*is_on.lock().unwrap());
    }

    #[test]
    fn a_flash_that_nobody_puts_off_goes_off_by_itself() {
        let (is_on, _, mut flash) = bulb(Duration::from_millis(20));
        assert!(!*is_on.lock().unwrap(), "off at the beginning");
        flash.flash(true).unwrap();
        wait_for_dark(&is_on);
        // And it can be used again.
        flash.flash(true).unwrap();
        wait_for_dark(&is_on);
        flash.flash(false).unwrap();
    }

    #[test]
    fn a_flash_that_does_not_obey_is_told_until_it_does() {
        let (is_on, deaf_for, mut flash) = bulb(Duration::from_secs(3600));
        flash.flash(true).unwrap();
        *deaf_for.lock().unwrap() = 2;
        assert!(flash.flash(false).is_err());
        wait_for_dark(&is_on);
    }

    #[test]
    fn a_flash_is_off_when_its_program_ends_or_panics() {
        let (is_on, _, mut flash) = bulb(Duration::from_secs(3600));
        flash.flash(true).unwrap();
        drop(flash);
        assert!(!*is_on.lock().unwrap());
        let (is_on, _, mut flash) = bulb(Duration::from_secs(3600));
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || {
            flash.flash(true).unwrap();
            panic!("as a test");
        }));
        assert!(panicked.is_err() && !*is_on.lock().unwrap());
    }
}
