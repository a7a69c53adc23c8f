//! Fault injection: the faults of a real tent, by name and rate.
//!
//! In: fault rates, a seed and the number of a photograph, which alone decide its faults. Out: [`FaultEvent`]s, and the bytes
//! that a camera with these faults writes.

mod spoil;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::pose::Pose;
use super::render::Renderer;
use super::view::View;
use crate::check::{OutOfRange, ensure};
use crate::lamps::Light;
use crate::photo::Image;
use crate::random::{Purpose, derive, stream, uniform};

/// A fault of a photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// The lit lamp has failed: neither plant nor camera gets its light.
    LampFails,
    /// The flash was not lit.
    MissedFlash,
    /// A leaf hangs in front of the tip.
    LeafAcross,
    /// The camera was displaced for an hour.
    Nudged,
    /// Lens flare of a lamp over the tip.
    Glare,
    /// A fly sits on the lens.
    Fly,
    /// Water condenses on the lens.
    Condensation,
    /// The file was cut short.
    HalfWritten,
    /// The camera handed out its last photograph once more.
    Repeated,
    /// There is no photograph at all.
    Dropped,
}

impl Fault {
    /// Every fault, in the order in which they act on a photograph.
    pub const ALL: [Self; 10] = [
        Self::LampFails,
        Self::MissedFlash,
        Self::LeafAcross,
        Self::Nudged,
        Self::Glare,
        Self::Fly,
        Self::Condensation,
        Self::HalfWritten,
        Self::Repeated,
        Self::Dropped,
    ];

    /// Duration, in photographs. Chosen by hand.
    #[must_use]
    pub const fn duration(self) -> u64 {
        match self {
            Self::Nudged => 12,
            Self::Condensation => 8,
            Self::LampFails => 6,
            Self::Glare => 3,
            Self::LeafAcross | Self::Fly => 2,
            Self::MissedFlash | Self::HalfWritten | Self::Repeated | Self::Dropped => 1,
        }
    }

    /// Whether the fault is optical: it changes the picture on its way to the sensor.
    const fn is_optical(self) -> bool {
        matches!(self, Self::Nudged | Self::Glare | Self::Fly | Self::Condensation)
    }

    /// Whether the fault affects all cameras at once: they share flash and lamps.
    #[must_use]
    pub const fn is_shared(self) -> bool {
        matches!(self, Self::LampFails | Self::MissedFlash)
    }
}

/// Fault rates: the probability per photograph, 0 to 1, that each fault begins. Default: 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Faults {
    /// Rate of [`Fault::LampFails`].
    pub lamp_fails: f64,
    /// Rate of [`Fault::MissedFlash`].
    pub missed_flash: f64,
    /// Rate of [`Fault::LeafAcross`].
    pub leaf_across: f64,
    /// Rate of [`Fault::Nudged`].
    pub nudged: f64,
    /// Rate of [`Fault::Glare`].
    pub glare: f64,
    /// Rate of [`Fault::Fly`].
    pub fly: f64,
    /// Rate of [`Fault::Condensation`].
    pub condensation: f64,
    /// Rate of [`Fault::HalfWritten`].
    pub half_written: f64,
    /// Rate of [`Fault::Repeated`].
    pub repeated: f64,
    /// Rate of [`Fault::Dropped`].
    pub dropped: f64,
}

/// A fault of one photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultEvent {
    /// The fault.
    pub fault: Fault,
    /// Photographs since the fault began, 0 for the first.
    pub age: u64,
    /// Random seed of its position and strength, constant as long as the fault lasts.
    pub seed: u64,
}

impl FaultEvent {
    fn rng(&self) -> ChaCha8Rng {
        stream(self.seed, Purpose::Scene, 0)
    }
}

impl Faults {
    fn rates(&self) -> [(&'static str, Fault, f64); 10] {
        [
            ("lamp_fails", Fault::LampFails, self.lamp_fails),
            ("missed_flash", Fault::MissedFlash, self.missed_flash),
            ("leaf_across", Fault::LeafAcross, self.leaf_across),
            ("nudged", Fault::Nudged, self.nudged),
            ("glare", Fault::Glare, self.glare),
            ("fly", Fault::Fly, self.fly),
            ("condensation", Fault::Condensation, self.condensation),
            ("half_written", Fault::HalfWritten, self.half_written),
            ("repeated", Fault::Repeated, self.repeated),
            ("dropped", Fault::Dropped, self.dropped),
        ]
    }

    /// Checks that every rate is a probability.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.rates().into_iter().try_for_each(|(key, _, rate)| {
            let is_probability = (0.0..=1.0).contains(&rate);
            ensure(is_probability, format!("faults.{key}"), rate, "a probability per photograph, 0 to 1")
        })
    }

    /// Faults of photograph number `frame` of the front camera under `seed`, in the order of [`Fault::ALL`], each at most once.
    ///
    /// ```
    /// use tropism::greenhouse::fault::{Fault, Faults};
    /// let faults = Faults { dropped: 1.0, ..Faults::default() };
    /// assert_eq!(faults.events_at(1, 0)[0].fault, Fault::Dropped);
    /// assert!(Faults::default().events_at(1, 0).is_empty());
    /// ```
    #[must_use]
    pub fn events_at(&self, seed: u64, frame: u64) -> Vec<FaultEvent> {
        self.events_for(View::Front, seed, frame)
    }

    /// [`Self::events_at`] for the camera of `view`: faults that are not shared begin independently for each camera.
    #[must_use]
    pub fn events_for(&self, view: View, seed: u64, frame: u64) -> Vec<FaultEvent> {
        // Seeds of their own, so that faults do not follow the folds of the cloth.
        let of_camera = |view: View| derive(seed, Purpose::Scene, u64::MAX - view as u64);
        let seeds = [of_camera(View::Front), of_camera(view)];
        let began = |fault: Fault, rate: f64, frame: u64| {
            let seed = seeds[usize::from(!fault.is_shared())];
            let mut rng = stream(seed, Purpose::Events, 16 * frame + fault as u64);
            (uniform(&mut rng) < rate).then(|| rng.random())
        };
        self.rates()
            .into_iter()
            .filter(|&(_, _, rate)| rate > 0.0)
            .filter_map(|(_, fault, rate)| {
                // The youngest counts: a camera that is pushed again stands where it was pushed last.
                (0..fault.duration().min(frame + 1)).find_map(|age| {
                    began(fault, rate, frame - age).map(|seed| FaultEvent { fault, age, seed })
                })
            })
            .collect()
    }
}

/// Whether one of `events` is `fault`.
#[must_use]
pub fn has_fault(events: &[FaultEvent], fault: Fault) -> bool {
    events.iter().any(|event| event.fault == fault)
}

/// The bytes that a camera with these faults writes, or `None` if it writes none. `last` is what it wrote before.
///
/// A failed lamp does not light the plant either: code that grows the plant must check [`has_fault`].
#[must_use]
pub fn photograph(
    renderer: &mut Renderer,
    events: &[FaultEvent],
    pose: &Pose,
    lit: Option<Light>,
    frame_index: u64,
    last: Option<&[u8]>,
) -> Option<Vec<u8>> {
    if has_fault(events, Fault::Dropped) {
        return None;
    }
    if let Some(last) = last.filter(|_| has_fault(events, Fault::Repeated)) {
        return Some(last.to_vec());
    }
    let lit = lit.filter(|_| !has_fault(events, Fault::LampFails));
    let flash = !has_fault(events, Fault::MissedFlash);
    let mut pose = pose.clone();
    for event in events.iter().filter(|event| event.fault == Fault::LeafAcross) {
        spoil::leaf_across(&mut pose, renderer.view(), &mut event.rng());
    }
    let optical: Vec<&FaultEvent> = events.iter().filter(|event| event.fault.is_optical()).collect();
    let mut bytes = if optical.is_empty() {
        renderer.photograph(&pose, lit, flash, frame_index)
    } else {
        let mut image = renderer.draw(&pose, lit, flash, frame_index);
        apply_optical_faults(&mut image, &optical, renderer, &pose);
        renderer.encode(&image)
    };
    for event in events.iter().filter(|event| event.fault == Fault::HalfWritten) {
        let share = 0.2 + 0.7 * uniform(&mut event.rng());
        bytes.truncate((share * bytes.len() as f64) as usize);
    }
    Some(bytes)
}

/// Applies optical faults to the picture of `pose`.
fn apply_optical_faults(image: &mut Image, optical: &[&FaultEvent], renderer: &Renderer, pose: &Pose) {
    let frame = renderer.frame();
    let top = frame.pixel(renderer.truth(pose).top);
    for event in optical {
        let rng = &mut event.rng();
        match event.fault {
            Fault::Nudged => spoil::nudged(image, frame.px_per_cm, rng),
            Fault::Glare => spoil::glare(image, top, frame.px_per_cm, rng),
            Fault::Fly => spoil::fly(image, top, frame.px_per_cm, rng),
            Fault::Condensation => {
                // It builds up over four photographs and clears over the last four.
                let ripe = (event.age + 1).min(Fault::Condensation.duration() - event.age);
                spoil::condensation(image, frame.px_per_cm, (ripe as f64 / 4.0).min(1.0));
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::greenhouse::pose::{Leaf, Node};
    use crate::greenhouse::render::truth;
    use crate::greenhouse::scene::Scene;
    use crate::photo::Photo;

    fn bean() -> Pose {
        let stem =
            (0..=20).map(|node| Node { at: [0.0, 0.7 * f64::from(node), 0.0], radius: 0.14 }).collect();
        let leaf = |sign| Leaf {
            base: [0.0, 13.0, 0.0],
            along: [0.8 * sign, 0.0, 0.6],
            across: [0.6 * sign, 0.0, -0.8],
            length: 3.0,
        };
        Pose {
            age_h: 30.0,
            stem,
            heading: [0.0, 1.0, 0.0],
            leaves: [leaf(1.0), leaf(-1.0)],
            spread: 1.0,
            withered: 0.2,
        }
    }

    fn of(fault: Fault, age: u64) -> Vec<FaultEvent> {
        vec![FaultEvent { fault, age, seed: 5 }]
    }

    fn taken(events: &[FaultEvent]) -> Option<Vec<u8>> {
        let mut renderer = Renderer::new(&Scene { width: 324, height: 243, ..Scene::default() }, 1);
        photograph(&mut renderer, events, &bean(), Some(Light::LEFT), 3, Some(b"the one before"))
    }

    fn picture(events: &[FaultEvent]) -> Image {
        let bytes = taken(events).unwrap();
        Photo { name: String::new(), bytes, time_s: 0.0 }.decode().unwrap()
    }

    fn mean(image: &Image) -> f64 {
        image.rgb.iter().map(|&byte| f64::from(byte)).sum::<f64>() / image.rgb.len() as f64
    }

    proptest! {
        #[test]
        fn a_fault_lasts_and_keeps_its_seed(seed in any::<u64>(), frame in 0..100_000_u64) {
            let faults = Faults { nudged: 0.02, glare: 0.1, dropped: 0.3, ..Faults::default() };
            let now = faults.events_at(seed, frame);
            prop_assert_eq!(&now, &faults.events_at(seed, frame));
            for event in now.iter().filter(|event| event.age > 0) {
                let before = faults.events_at(seed, frame - 1);
                let younger = FaultEvent { age: event.age - 1, ..*event };
                prop_assert!(before.contains(&younger), "{before:?} then {event:?}");
            }
        }
    }

    #[test]
    fn faults_come_at_their_rate() {
        let faults = Faults { missed_flash: 0.05, half_written: 0.2, ..Faults::default() };
        let count = |fault| (0..4000).filter(|&frame| has_fault(&faults.events_at(9, frame), fault)).count();
        assert!((150..250).contains(&count(Fault::MissedFlash)), "{}", count(Fault::MissedFlash));
        assert!((700..900).contains(&count(Fault::HalfWritten)), "{}", count(Fault::HalfWritten));
        assert_eq!(count(Fault::Fly), 0);
    }

    #[test]
    fn cameras_share_the_lights_and_nothing_else() {
        let faults =
            Faults { lamp_fails: 0.1, missed_flash: 0.1, fly: 0.1, dropped: 0.1, ..Faults::default() };
        let (mut shared, mut own) = (0, [0; 3]);
        for frame in 0..500 {
            let [front, side] = View::BOTH.map(|view| faults.events_for(view, 4, frame));
            assert_eq!(front, faults.events_at(4, frame));
            for fault in [Fault::LampFails, Fault::MissedFlash] {
                assert_eq!(has_fault(&front, fault), has_fault(&side, fault), "{fault:?} at {frame}");
                shared += usize::from(has_fault(&front, fault));
            }
            let has_fly = [&front, &side].map(|events| has_fault(events, Fault::Fly));
            own[0] += usize::from(has_fly[0]);
            own[1] += usize::from(has_fly[1]);
            own[2] += usize::from(has_fly == [true; 2]);
        }
        assert!(shared > 50 && own[0] > 50 && own[1] > 50 && own[2] < own[0] / 2, "{shared} {own:?}");
    }

    #[test]
    fn a_leaf_across_hides_the_tip_from_either_side() {
        for view in View::BOTH {
            let mut renderer = Renderer::at(view, &Scene { width: 324, height: 243, ..Scene::default() }, 1);
            let mut taken = |events: &[FaultEvent]| {
                let bytes = photograph(&mut renderer, events, &bean(), None, 3, None).unwrap();
                Photo { name: String::new(), bytes, time_s: 0.0 }.decode().unwrap()
            };
            let (plain, hidden) = (taken(&[]), taken(&of(Fault::LeafAcross, 0)));
            // Face on, it is as wide to one camera as to the other.
            let apex = renderer.frame().pixel(renderer.truth(&bean()).apex);
            let green = |image: &Image| {
                let around = (0..400)
                    .map(|at| image.at(apex.x as usize - 10 + at % 20, apex.y as usize - 10 + at / 20));
                around.filter(|rgb| rgb[1] > 70 && rgb[1] > rgb[2] + 30).count()
            };
            assert!(
                green(&hidden) > green(&plain) + 40,
                "{view:?}: {} after {}",
                green(&hidden),
                green(&plain)
            );
        }
    }

    #[test]
    fn files_go_missing_stay_old_or_are_cut_short() {
        assert_eq!(taken(&of(Fault::Dropped, 0)), None);
        assert_eq!(taken(&of(Fault::Repeated, 0)).unwrap(), b"the one before");
        let bytes = taken(&of(Fault::HalfWritten, 0)).unwrap();
        assert!(bytes.len() > 100 && bytes.len() < taken(&[]).unwrap().len());
        assert!(Photo { name: String::new(), bytes, time_s: 0.0 }.decode().is_err());
    }

    #[test]
    fn lights_that_fail_leave_the_tent_darker() {
        let plain = mean(&picture(&[]));
        let no_lamp = mean(&picture(&of(Fault::LampFails, 0)));
        let no_flash = mean(&picture(&of(Fault::MissedFlash, 0)));
        let neither = mean(&picture(&[of(Fault::LampFails, 0), of(Fault::MissedFlash, 0)].concat()));
        assert!(no_lamp < 0.9 * plain && no_flash < 0.8 * plain && neither < 0.3 * plain);
    }

    #[test]
    fn what_is_in_the_way_changes_the_picture_as_it_should() {
        let plain = picture(&[]);
        let top = {
            let frame = Scene { width: 324, height: 243, ..Scene::default() }.frame();
            frame.pixel(truth(&bean(), frame).top)
        };
        let at_tip = |image: &Image| image.at(top.x as usize + 3, top.y as usize + 2);
        assert!(at_tip(&picture(&of(Fault::Glare, 0)))[2] > at_tip(&plain)[2] + 60);
        assert!(at_tip(&picture(&of(Fault::LeafAcross, 0)))[1] > at_tip(&plain)[1] + 30);
        assert!(mean(&picture(&of(Fault::Fly, 0))) < mean(&plain));
        // Condensation takes the plant's contrast away: most in the middle of it.
        let contrast = |image: &Image| {
            let row = top.y as usize + 30;
            (130..194).map(|x| image.at(x, row)[1]).max().unwrap_or(0)
        };
        let misty = contrast(&picture(&of(Fault::Condensation, 4)));
        assert!(misty < contrast(&picture(&of(Fault::Condensation, 0))) && misty + 40 < contrast(&plain));
        let nudged = picture(&of(Fault::Nudged, 3));
        assert_ne!(nudged, plain);
        assert_eq!(nudged, picture(&of(Fault::Nudged, 11)));
    }
}
