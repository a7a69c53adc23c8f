//! Fault injection: the faults of a real tent, by name and rate.
//!
//! In: fault rates, a seed and the number of a photograph, which alone decide its faults. Out: [`FaultEvent`]s, and the bytes
//! that a camera with these faults writes.

mod spoil;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use tropism::check::{OutOfRange, ensure};
use tropism::lighting::Lighting;
use tropism::photo::Image;
use tropism::random::{Purpose, derive, stream, uniform};

use super::pose::Pose;
use super::render::Renderer;
use super::view::View;

/// The faults and their rates. Of each: what it is, its name, its key, and its duration in photographs.
macro_rules! faults {
    ($($(#[$doc:meta])+ $fault:ident $key:ident $photographs:literal;)+) => {
        /// A fault of a photograph.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum Fault {
            $($(#[$doc])+ $fault,)+
        }

        impl Fault {
            /// Duration, in photographs.
            #[must_use]
            pub const fn duration(self) -> u64 {
                match self {
                    $(Self::$fault => $photographs,)+
                }
            }
        }

        /// Fault rates: the probability per photograph, 0 to 1, that each fault begins. Default: 0.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(default, deny_unknown_fields)]
        pub struct Faults {
            $(#[doc = concat!("Rate of [`Fault::", stringify!($fault), "`].")] pub $key: f64,)+
        }

        impl Faults {
            fn rates(&self) -> impl Iterator<Item = (&'static str, Fault, f64)> {
                [$((stringify!($key), Fault::$fault, self.$key)),+].into_iter()
            }
        }
    };
}

// In the order in which they act on a photograph. Durations are chosen by hand.
faults! {
    /// The lit lamp has failed: neither plant nor camera gets its light.
    LampFails lamp_fails 6;
    /// The flash was not lit.
    MissedFlash missed_flash 1;
    /// A leaf hangs in front of the tip.
    LeafAcross leaf_across 2;
    /// The camera was displaced for an hour.
    Nudged nudged 12;
    /// Lens flare of a lamp over the tip.
    Glare glare 3;
    /// A fly sits on the lens.
    Fly fly 2;
    /// Water condenses on the lens.
    Condensation condensation 8;
    /// The file was cut short.
    HalfWritten half_written 1;
    /// The camera handed out its last photograph once more.
    Repeated repeated 1;
    /// There is no photograph at all.
    Dropped dropped 1;
}

impl Fault {
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
    /// Checks that every rate is a probability.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.rates().try_for_each(|(key, _, rate)| {
            let is_probability = (0.0..=1.0).contains(&rate);
            ensure(is_probability, format!("faults.{key}"), rate, "a probability per photograph, 0 to 1")
        })
    }

    /// Faults of photograph number `frame` of the front camera under `seed`, in the order of [`Fault`], each at most once.
    ///
    /// ```
    /// use tropism_bean::fault::{Fault, Faults};
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
    lit: impl Into<Lighting>,
    frame_index: u64,
    last: Option<&[u8]>,
) -> Option<Vec<u8>> {
    if has_fault(events, Fault::Dropped) {
        return None;
    }
    if let Some(last) = last.filter(|_| has_fault(events, Fault::Repeated)) {
        return Some(last.to_vec());
    }
    let lit = if has_fault(events, Fault::LampFails) { Lighting::DARK } else { lit.into() };
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
