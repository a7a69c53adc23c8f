//! Devices that are on or off, or have levels: the interlock of the lamps, and the time limit of the flash.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use tropism::lamps::{Light, MAX_LAMPS};
use tropism::lighting::{Allowed, FULL, Lighting};
use tropism::rig::{Flash, Lamps, RigError};

use crate::failed;

/// A device that is on or off.
pub trait Switch: Send {
    /// Switches the device, and returns after it has confirmed, as far as it can.
    ///
    /// # Errors
    /// [`RigError::Device`] if the device does not confirm; then its state is unknown.
    fn switch(&mut self, is_on: bool) -> Result<(), RigError>;

    /// Sets the level, 0 (dark) to 255 (full power), and returns after the device has confirmed, as far as it can.
    ///
    /// # Errors
    /// As [`Self::switch`]. A device that is only on or off refuses all other levels, and is as it was.
    fn dim(&mut self, level: u8) -> Result<(), RigError> {
        match level {
            0 => self.switch(false),
            FULL => self.switch(true),
            _ => Err(cannot_dim("lamp", level)),
        }
    }
}

/// The refusal of a device that is only on or off.
pub(crate) fn cannot_dim(device: &str, level: u8) -> RigError {
    failed(
        device,
        format!("found level {level} of {FULL}, wanted 0 or {FULL}: this driver only switches on and off"),
    )
}

impl<T: Switch + ?Sized> Switch for Box<T> {
    fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
        (**self).switch(is_on)
    }

    fn dim(&mut self, level: u8) -> Result<(), RigError> {
        (**self).dim(level)
    }
}

/// 2 to 16 lamps, of which no more shine than are [allowed](Allowed): by default one at full power.
///
/// Break before make: first all that goes dark or down, and nothing is raised unless every device has confirmed that. So at
/// no moment do more lamps shine, or with more power, than is allowed.
#[derive(Debug)]
pub struct Interlock<S> {
    /// In the order of the layout.
    lamps: Vec<InterlockedLamp<S>>,
    /// Time between the darkness of one lamp and the light of another.
    pause: Duration,
    allowed: Allowed,
}

#[derive(Debug)]
struct InterlockedLamp<S> {
    switch: S,
    /// The level that the device confirmed last; `None` if it may have any.
    level: Option<u8>,
}

impl<S: Switch> InterlockedLamp<S> {
    fn dim(&mut self, level: u8) -> Result<(), RigError> {
        // The state is unknown until the device confirms.
        self.level = None;
        self.switch.dim(level)?;
        self.level = Some(level);
        Ok(())
    }
}

impl<S: Switch> Interlock<S> {
    /// Lamps in an unknown state, in the order of their layout, with `pause` between the darkness of one lamp and the
    /// light of another.
    pub fn new(lamps: impl IntoIterator<Item = S>, pause: Duration) -> Self {
        let lamps = lamps.into_iter().map(|switch| InterlockedLamp { switch, level: None }).collect();
        Self { lamps, pause, allowed: Allowed::One }
    }

    /// The same lamps, of which as many may shine as `allowed` says.
    #[must_use]
    pub const fn allowing(mut self, allowed: Allowed) -> Self {
        self.allowed = allowed;
        self
    }

    /// The commands that bring the lamps to `levels`, in their order: lamp and level.
    ///
    /// Each lamp is commanded each time: a device that restarted may have lost its state. A lamp of unknown level can only
    /// be lowered for sure by going dark; one that shall shine alone need not, as all others are dark by then.
    fn commands(&self, levels: [u8; MAX_LAMPS]) -> Vec<(Change, usize, u8)> {
        let is_alone = levels.iter().filter(|&&level| level > 0).count() == 1;
        let mut commands = Vec::new();
        for (index, (lamp, level)) in self.lamps.iter().zip(levels).enumerate() {
            let change = match lamp.level {
                _ if level == 0 => Change::Darken,
                Some(now) if level < now => Change::Lower,
                Some(now) if level == now => Change::Hold,
                None if !is_alone => {
                    commands.push((Change::Darken, index, 0));
                    Change::Raise
                }
                _ => Change::Raise,
            };
            commands.push((change, index, level));
        }
        commands.sort_by_key(|(change, ..)| *change);
        commands
    }
}

/// What a command does to a lamp, in the order in which commands are given. Lamps that stay as they are come before those that
/// are raised: one that restarted may be brighter than is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Change {
    Darken,
    Lower,
    Hold,
    Raise,
}

impl<S: Switch> Lamps for Interlock<S> {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        self.shine(light.into())
    }

    fn shine(&mut self, lighting: Lighting) -> Result<(), RigError> {
        if let Some((light, _)) = lighting.lit().find(|(light, _)| light.index() >= self.lamps.len()) {
            let problem =
                format!("found lamp number {}, wanted 1 to {}", light.index() + 1, self.lamps.len());
            return Err(failed("lamps", problem));
        }
        self.allowed.permit(lighting).map_err(|problem| failed("lamps", problem.to_string()))?;
        let commands = self.commands(lighting.levels());
        let (lowering, raising) =
            commands.split_at(commands.partition_point(|(change, ..)| *change < Change::Hold));
        // All are lowered even if one fails; the first error is returned.
        let (mut were_low, mut result) = (true, Ok(()));
        for &(_, index, level) in lowering {
            were_low &= self.lamps[index].level == Some(level);
            result = result.and(self.lamps[index].dim(level));
        }
        result?;
        if !were_low && !raising.is_empty() {
            thread::sleep(self.pause);
        }
        raising.iter().try_for_each(|&(_, index, level)| self.lamps[index].dim(level))
    }
}

/// A flash with a time limit.
///
/// A separate thread switches the flash off when the limit has passed, and repeats the command until the device confirms.
/// The limit holds as long as the process lives; for a killed process, docs/how-to/wire-safely.md names the timers of the devices.
pub struct BoundedFlash {
    shared: Arc<(Mutex<State>, Condvar)>,
    settle: Duration,
    max_on: Duration,
    watchdog: Option<JoinHandle<()>>,
}

struct State {
    switch: Box<dyn Switch>,
    /// When the watchdog switches it off; `None` if it is confirmed to be off.
    off_at: Option<Instant>,
    is_over: bool,
}

/// Pause of the watchdog between two attempts: chosen by hand.
const RETRY_PAUSE: Duration = Duration::from_secs(1);

impl BoundedFlash {
    /// A flash that waits `settle` after switching on, and is on for at most `max_on`.
    ///
    /// # Errors
    /// If it cannot be switched off at the start.
    pub fn new(mut switch: Box<dyn Switch>, settle: Duration, max_on: Duration) -> Result<Self, RigError> {
        switch.switch(false)?;
        let state = State { switch, off_at: None, is_over: false };
        let shared = Arc::new((Mutex::new(state), Condvar::new()));
        let watched = Arc::clone(&shared);
        let watchdog = Some(thread::spawn(move || watchdog(&watched)));
        Ok(Self { shared, settle, max_on, watchdog })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.shared.0)
    }
}

/// The content of `mutex`, even after a driver panicked with it: the flash must still be switched off.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn watchdog((state, changed): &(Mutex<State>, Condvar)) {
    let mut state = lock(state);
    loop {
        match state.off_at {
            Some(off_at) if state.is_over || off_at <= Instant::now() => {
                state.off_at = state.switch.switch(false).is_err().then(|| Instant::now() + RETRY_PAUSE);
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
        // Set the limit first: a command that fails may still switch the flash on.
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
        if let Some(watchdog) = self.watchdog.take() {
            // A panic of the watchdog has already been reported.
            let _ = watchdog.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::wait_until;

    /// How a simulated lamp answers a command.
    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    enum Answer {
        /// Obeys and confirms.
        #[default]
        Confirmed,
        /// Does nothing and confirms nothing.
        Ignored,
        /// Obeys, but the confirmation is lost.
        Unconfirmed,
    }

    /// Simulated lamps of one tent.
    #[derive(Default)]
    struct Tent {
        is_lit: Vec<bool>,
        /// The largest number of lamps that were lit after a command to light one.
        most_lit: usize,
        /// Lamp and command, of all commands that were obeyed.
        commands: Vec<(usize, bool)>,
        /// Answers to the next commands, last first; then all are confirmed.
        answers: Vec<Answer>,
    }

    struct TentLamp {
        tent: Arc<Mutex<Tent>>,
        index: usize,
    }

    impl Switch for TentLamp {
        fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
            let mut tent = lock(&self.tent);
            let answer = tent.answers.pop().unwrap_or_default();
            if answer != Answer::Ignored {
                tent.is_lit[self.index] = is_on;
                tent.commands.push((self.index, is_on));
            }
            if is_on {
                tent.most_lit = tent.most_lit.max(tent.is_lit.iter().filter(|&&is_lit| is_lit).count());
            }
            if answer == Answer::Confirmed {
                Ok(())
            } else {
                Err(failed(format!("lamp {}", self.index), "no confirmation came"))
            }
        }
    }

    fn lamps(is_lit: Vec<bool>, answers: Vec<Answer>) -> (Arc<Mutex<Tent>>, Interlock<TentLamp>) {
        let count = is_lit.len();
        let tent = Arc::new(Mutex::new(Tent { is_lit, answers, ..Tent::default() }));
        let lamp = |index| TentLamp { tent: Arc::clone(&tent), index };
        (Arc::clone(&tent), Interlock::new((0..count).map(lamp), Duration::ZERO))
    }

    fn answers(longest: usize) -> impl Strategy<Value = Vec<Answer>> {
        let answer = prop_oneof![
            7 => Just(Answer::Confirmed),
            2 => Just(Answer::Ignored),
            1 => Just(Answer::Unconfirmed),
        ];
        proptest::collection::vec(answer, 0..longest)
    }

    proptest! {
        #[test]
        fn two_lamps_are_never_lit_whatever_fails(
            lights in proptest::collection::vec(proptest::option::of(any::<bool>()), 1..40),
            answers in answers(60),
        ) {
            let (tent, mut lamps) = lamps(vec![false; 2], answers);
            for light in lights {
                let light = light.map(|is_left| if is_left { Light::LEFT } else { Light::RIGHT });
                let done = lamps.light(light);
                let tent = lock(&tent);
                if done.is_ok() {
                    let lit = Light::BOTH.map(|side| light == Some(side));
                    prop_assert_eq!(&tent.is_lit, &lit);
                }
                prop_assert!(tent.most_lit <= 1);
            }
        }

        /// Whatever the lamps were at the start, and however their switches fail.
        #[test]
        fn at_most_one_of_2_to_8_lamps_is_lit_whatever_fails(
            is_lit in proptest::collection::vec(any::<bool>(), 2..=8),
            lights in proptest::collection::vec(proptest::option::of(0_usize..8), 1..40),
            answers in answers(200),
        ) {
            let count = is_lit.len();
            let (tent, mut lamps) = lamps(is_lit, answers);
            for light in lights {
                let result = lamps.light(light.and_then(Light::new));
                let known_dark: Vec<bool> = lamps.lamps.iter().map(|lamp| lamp.level == Some(0)).collect();
                let tent = lock(&tent);
                prop_assert!(tent.most_lit <= 1);
                // No lamp is taken for dark that is lit.
                for (index, is_lit) in tent.is_lit.iter().enumerate() {
                    prop_assert!(!(known_dark[index] && *is_lit));
                }
                if light.is_some_and(|index| index >= count) {
                    prop_assert!(result.is_err());
                } else if result.is_ok() {
                    let wanted: Vec<bool> = (0..count).map(|index| light == Some(index)).collect();
                    prop_assert_eq!(&tent.is_lit, &wanted);
                }
            }
            // With devices that obey again, all of them go dark.
            lock(&tent).answers.clear();
            prop_assert!(lamps.light(None).is_ok());
            prop_assert!(!lock(&tent).is_lit.contains(&true));
        }
    }

    /// Simulated dimmers: their levels, and each moment after a command.
    #[derive(Default)]
    struct Dimmers {
        levels: Lighting,
        moments: Vec<Lighting>,
        answers: Vec<Answer>,
    }

    struct Dimmer(Arc<Mutex<Dimmers>>, Light);

    impl Switch for Dimmer {
        fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
            self.dim(if is_on { FULL } else { 0 })
        }

        fn dim(&mut self, level: u8) -> Result<(), RigError> {
            let mut all = lock(&self.0);
            let answer = all.answers.pop().unwrap_or_default();
            if answer != Answer::Ignored {
                all.levels = all.levels.with(self.1, level);
                let now = all.levels;
                all.moments.push(now);
            }
            if answer == Answer::Confirmed { Ok(()) } else { Err(failed("lamp", "no confirmation came")) }
        }
    }

    fn dimmers(
        count: usize,
        answers: Vec<Answer>,
        allowed: Allowed,
    ) -> (Arc<Mutex<Dimmers>>, Interlock<Dimmer>) {
        let all = Arc::new(Mutex::new(Dimmers { answers, ..Dimmers::default() }));
        let lamps = (0..count).filter_map(Light::new).map(|light| Dimmer(Arc::clone(&all), light));
        (Arc::clone(&all), Interlock::new(lamps, Duration::ZERO).allowing(allowed))
    }

    fn lighting(count: usize) -> impl Strategy<Value = Lighting> {
        let level = prop_oneof![3 => Just(0), 1 => Just(FULL), 3 => any::<u8>()];
        proptest::collection::vec(level, count).prop_map(|levels| {
            let lamps =
                levels.into_iter().enumerate().filter_map(|(index, level)| Some((Light::new(index)?, level)));
            lamps.fold(Lighting::DARK, |lighting, (light, level)| lighting.with(light, level))
        })
    }

    proptest! {
        /// However the devices fail: after each single command no more is lit than allowed.
        #[test]
        fn no_more_shines_than_is_allowed_also_in_between(
            lightings in proptest::collection::vec(lighting(6), 1..30),
            answers in answers(120),
            most_lit in 1_u8..=6,
            budget in 0.5..6.0,
        ) {
            let allowed = Allowed::Any { most_lit, budget };
            let (all, mut lamps) = dimmers(6, answers, allowed);
            for lighting in lightings {
                let before = lock(&all).moments.len();
                let done = lamps.shine(lighting);
                let all = lock(&all);
                prop_assert!(all.moments.iter().all(|moment| allowed.permit(*moment).is_ok()), "{:?}", all.moments);
                if allowed.permit(lighting).is_err() {
                    prop_assert!(done.is_err() && all.moments.len() == before, "nothing was commanded");
                } else if done.is_ok() {
                    prop_assert_eq!(all.levels, lighting);
                }
            }
            lock(&all).answers.clear();
            prop_assert!(lamps.light(None).is_ok());
            prop_assert_eq!(lock(&all).levels, Lighting::DARK);
        }
    }

    #[test]
    fn what_goes_down_goes_first_and_a_lamp_of_unknown_level_goes_dark_before_it_shines_with_others() {
        let (all, mut lamps) = dimmers(3, vec![], Allowed::Any { most_lit: 2, budget: 1.0 });
        let levels = |levels: [u8; 3]| {
            let lights = (0..).map_while(Light::new).zip(levels);
            lights.fold(Lighting::DARK, |lighting, (light, level)| lighting.with(light, level))
        };
        lock(&all).levels = levels([0, 200, 255]);
        for lighting in [[100, 150, 0], [155, 100, 0], [0, 100, 155]] {
            lamps.shine(levels(lighting)).unwrap();
        }
        let moments = [
            // Unknown at the start.
            [0, 200, 255],
            [0, 0, 255],
            [0, 0, 0],
            [100, 0, 0],
            [100, 150, 0],
            [100, 150, 0],
            [100, 100, 0],
            [155, 100, 0],
            [0, 100, 0],
            [0, 100, 0],
            [0, 100, 155],
        ];
        assert_eq!(lock(&all).moments, moments.map(levels));
        let error = lamps.shine(levels([200, 100, 0])).unwrap_err().to_string();
        assert_eq!(error, "lamps: found a power of 1.18 full lamps, wanted at most 1 (`budget`)");
        let error = lamps.allowing(Allowed::One).shine(levels([200, 0, 0])).unwrap_err().to_string();
        assert!(error.contains("wanted one lamp at full power or darkness"), "{error}");
    }

    #[test]
    fn a_switch_refuses_levels() {
        let (tent, lamps) = lamps(vec![false; 2], vec![]);
        let mut lamps = lamps.allowing(Allowed::Any { most_lit: 2, budget: 2.0 });
        lamps.shine(Lighting::only(Light::LEFT).with(Light::RIGHT, FULL)).unwrap();
        assert_eq!(lock(&tent).is_lit, [true; 2]);
        let error = lamps.shine(Lighting::DARK.with(Light::LEFT, 9)).unwrap_err().to_string();
        assert!(error.contains("found level 9 of 255, wanted 0 or 255"), "{error}");
    }

    #[test]
    fn one_goes_dark_before_the_other_is_lit_and_both_are_darkened_even_if_one_does_not_obey() {
        let (tent, mut both) = lamps(vec![false; 2], vec![]);
        both.light(Some(Light::RIGHT)).unwrap();
        both.light(Some(Light::LEFT)).unwrap();
        assert_eq!(lock(&tent).commands, [(0, false), (1, true), (1, false), (0, true)]);
        let (tent, mut both) = lamps(vec![false; 2], vec![Answer::Ignored]);
        assert!(both.light(None).is_err());
        assert_eq!(lock(&tent).commands, [(1, false)]);
    }

    #[test]
    fn all_other_lamps_go_dark_before_one_is_lit_and_none_is_lit_if_one_of_them_does_not_obey() {
        let (tent, mut four) = lamps(vec![true; 4], vec![]);
        four.light(Some(Light::FRONT)).unwrap();
        assert_eq!(lock(&tent).commands, [(0, false), (1, false), (3, false), (2, true)]);
        lock(&tent).commands.clear();
        lock(&tent).answers = vec![Answer::Ignored];
        let error = four.light(Some(Light::BACK)).unwrap_err().to_string();
        assert_eq!(error, "lamp 0: no confirmation came");
        assert_eq!(lock(&tent).commands, [(1, false), (2, false)]);
        assert_eq!(lock(&tent).is_lit, [false; 4]);
        let error = four.light(Light::new(4)).unwrap_err().to_string();
        assert_eq!(error, "lamps: found lamp number 5, wanted 1 to 4");
    }

    #[test]
    fn the_pause_comes_only_where_a_lamp_was_not_known_to_be_dark() {
        let pause = Duration::from_millis(200);
        let (_, mut lamps) = lamps(vec![false; 3], vec![]);
        lamps.pause = pause;
        let mut time = |light: Option<Light>| {
            let started = Instant::now();
            lamps.light(light).unwrap();
            started.elapsed()
        };
        assert!(time(Some(Light::LEFT)) >= pause, "unknown at the start");
        assert!(time(Some(Light::RIGHT)) >= pause, "left was lit");
        time(None);
        assert!(time(Some(Light::FRONT)) < pause, "all were dark");
        assert!(time(Some(Light::FRONT)) < pause, "the others were dark");
    }

    /// A bulb that ignores the next `deaf_for` commands.
    struct Bulb {
        is_on: Arc<Mutex<bool>>,
        deaf_for: Arc<Mutex<usize>>,
    }

    impl Switch for Bulb {
        fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
            let mut deaf_for = self.deaf_for.lock().unwrap();
            if *deaf_for > 0 {
                *deaf_for -= 1;
                return Err(failed("flash", "deaf"));
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
    fn a_forgotten_flash_goes_off_by_itself() {
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
