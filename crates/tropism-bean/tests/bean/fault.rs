//! What goes wrong in the virtual tent.

use proptest::prelude::*;
use tropism::lamps::Light;
use tropism::photo::{Image, Photo};
use tropism_bean::fault::{Fault, FaultEvent, Faults, has_fault, photograph};
use tropism_bean::pose::{Leaf, Node, Pose};
use tropism_bean::render::{Renderer, truth};
use tropism_bean::scene::Scene;
use tropism_bean::view::View;

fn bean() -> Pose {
    let stem = (0..=20).map(|node| Node { at: [0.0, 0.7 * f64::from(node), 0.0], radius: 0.14 }).collect();
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
    let faults = Faults { lamp_fails: 0.1, missed_flash: 0.1, fly: 0.1, dropped: 0.1, ..Faults::default() };
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
            let around =
                (0..400).map(|at| image.at(apex.x as usize - 10 + at % 20, apex.y as usize - 10 + at / 20));
            around.filter(|rgb| rgb[1] > 70 && rgb[1] > rgb[2] + 30).count()
        };
        assert!(green(&hidden) > green(&plain) + 40, "{view:?}: {} after {}", green(&hidden), green(&plain));
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
