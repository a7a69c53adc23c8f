//! A segment of a WLED controller as a lamp, over its JSON interface.
//!
//! The controller loses its segments when it restarts, so each command sets the complete segment. The answer is read back,
//! and the uptime shows whether the controller restarted meanwhile. Its nightlight timer switches the light off some
//! minutes after the last command, in case this program is dead.
//!
//! # References
//! WLED documentation, "JSON API": <https://kno.wled.ge/interfaces/json-api/>.

use std::thread;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::json;
use tropism::lighting::FULL;
use tropism::rig::RigError;

use crate::broker::Broker;
use crate::http::{Request, check_url};
use crate::seconds::{Seconds, ten};
use crate::settings::{LampSettings, Outlet};
use crate::strip::Strip;
use crate::switch::Switch;
use crate::{device, failed};

/// A segment of a controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WledLamp {
    /// Address of the controller, such as `http://wled-left.local`.
    pub url: String,
    /// Number of the segment; lamps on one controller have different ones.
    #[serde(default)]
    pub segment: u8,
    /// Its pixels.
    pub strip: Strip,
    /// Minutes after the last command until the controller switches all of its light off; 0: never. Must be longer than two
    /// steps, or the lamp goes dark between them.
    #[serde(default = "twelve")]
    pub dead_man_min: u8,
    /// Time limit of one command.
    #[serde(default = "ten")]
    pub timeout_s: Seconds,
}

const fn twelve() -> u8 {
    12
}

/// The largest answer, in bytes: chosen by hand.
const MAX_BYTES: u64 = 1 << 20;

/// Pause after switching the timer off: chosen longer than the 100 ms loop in which the controller notices it.
const TIMER_PAUSE: Duration = Duration::from_millis(250);

/// Pause before the state is read once more: chosen longer than the 100 ms loop of the controller.
const REVERT_PAUSE: Duration = Duration::from_millis(250);

impl LampSettings for WledLamp {
    fn check(&self, period_min: f64) -> Result<(), String> {
        check_url(&self.url)?;
        if self.segment > 31 {
            return Err(format!("found segment = {}, wanted 0 to 31", self.segment));
        }
        if self.dead_man_min > 0 && f64::from(self.dead_man_min) <= 2.0 * period_min {
            return Err(format!(
                "found dead_man_min = {}, wanted more than two steps of {period_min} minutes, or 0 for none",
                self.dead_man_min
            ));
        }
        self.strip.check()
    }

    fn outlet(&self) -> Outlet {
        let device = format!("wled {}", device::address(&self.url));
        Outlet::Pixels { device, segment: Some(self.segment), strip: self.strip }
    }

    fn dims(&self) -> bool {
        true
    }

    fn open(&self, device: &str, _broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        Ok(Box::new(OpenWledLamp { settings: self.clone(), device: device.to_owned() }))
    }

    fn timeout_s(&self) -> f64 {
        self.timeout_s.into()
    }
}

impl WledLamp {
    /// The complete segment, so that no former setting remains.
    fn segment(&self, level: u8) -> serde_json::Value {
        json!({
            "id": self.segment, "start": self.strip.first, "stop": self.strip.stop(),
            "grp": 1, "spc": 0, "of": 0, "on": level > 0, "bri": self.brightness(level), "fx": 0, "pal": 0, "frz": false,
            "col": [self.strip.color, [0, 0, 0], [0, 0, 0]],
        })
    }

    /// Brightness of the segment at a level, 1 to 255: WLED takes 0 for "off, and as bright as before". The brightness at full
    /// power stands for a dark segment.
    fn brightness(&self, level: u8) -> u8 {
        let share = if level == 0 { 1.0 } else { f64::from(level) / f64::from(FULL) };
        (self.strip.duty * share * 255.0).round().clamp(1.0, 255.0) as u8
    }

    /// Checks that the controller reports the commanded state.
    ///
    /// # Errors
    /// What was found, and what was wanted.
    pub fn confirm(&self, state: &WledState, level: u8) -> Result<(), String> {
        let is_on = level > 0;
        let Some(segment) = state.seg.iter().find(|segment| segment.id == self.segment) else {
            return Err(format!("it has no segment {}", self.segment));
        };
        let (start, stop) = (self.strip.first, self.strip.stop());
        if (segment.start, segment.stop) != (start, stop) {
            return Err(format!(
                "found segment {} from pixel {} to {}, wanted {start} to {stop}",
                self.segment, segment.start, segment.stop
            ));
        }
        let is_lit = state.on && segment.on;
        if is_lit != is_on {
            let name = |is_on| if is_on { "on" } else { "off" };
            return Err(format!("it is {}, and should be {}", name(is_lit), name(is_on)));
        }
        if !is_on {
            return Ok(());
        }
        let color = segment.col.first().and_then(|color| color.get(..3)).unwrap_or_default();
        if state.bri != 255
            || segment.bri != self.brightness(level)
            || segment.fx != 0
            || color != self.strip.color
        {
            return Err(format!(
                "found brightness {} of 255 x {}, effect {}, color {color:?}; wanted 255 x {}, 0, {:?}",
                state.bri,
                segment.bri,
                segment.fx,
                self.brightness(level),
                self.strip.color
            ));
        }
        Ok(())
    }

    /// Other segments over pixels of this lamp, left by a restart or a user.
    fn overlapping_segments(&self, state: &WledState) -> Vec<u8> {
        let overlaps = |segment: &&WledSegment| {
            segment.id != self.segment && segment.start < self.strip.stop() && self.strip.first < segment.stop
        };
        state.seg.iter().filter(overlaps).map(|segment| segment.id).collect()
    }
}

/// State of the controller, as it reports it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct WledState {
    on: bool,
    bri: u8,
    #[serde(default)]
    nl: Nightlight,
    seg: Vec<WledSegment>,
}

#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
struct Nightlight {
    on: bool,
    /// Remaining seconds; -1 if it is off.
    #[serde(default)]
    rem: i64,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
struct WledSegment {
    #[serde(default)]
    id: u8,
    start: u16,
    stop: u16,
    #[serde(default)]
    on: bool,
    #[serde(default)]
    bri: u8,
    #[serde(default)]
    fx: u16,
    #[serde(default)]
    col: Vec<Vec<u8>>,
}

impl WledState {
    /// The state in an answer to `POST /json/state` with `"v":true`.
    ///
    /// # Errors
    /// What is wrong with the answer.
    pub fn parse(answer: &[u8]) -> Result<Self, String> {
        parse(answer)
    }
}

/// Hardware and uptime of the controller, as it reports them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct WledInfo {
    leds: Leds,
    /// Seconds since its boot.
    uptime: u64,
    /// Whether another program streams pixels to it.
    #[serde(default)]
    live: bool,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
struct Leds {
    count: u32,
}

impl WledInfo {
    /// The answer to `GET /json/info`.
    ///
    /// # Errors
    /// What is wrong with the answer.
    pub fn parse(answer: &[u8]) -> Result<Self, String> {
        parse(answer)
    }
}

fn parse<'a, T: Deserialize<'a>>(answer: &'a [u8]) -> Result<T, String> {
    serde_json::from_slice(answer).map_err(|error| format!("found an answer that is not WLED's: {error}"))
}

/// An open lamp.
pub(crate) struct OpenWledLamp {
    settings: WledLamp,
    device: String,
}

impl OpenWledLamp {
    fn error(&self, problem: String) -> RigError {
        failed(format!("{} ({})", self.device, self.settings.url), problem)
    }

    fn send(
        &self,
        path: &str,
        json: Option<&serde_json::Value>,
        deadline: Instant,
    ) -> Result<Vec<u8>, RigError> {
        let url = format!("{}/{path}", self.settings.url.trim_end_matches('/'));
        let request =
            Request { device: &self.device, url: &url, authorization: None, deadline, max_bytes: MAX_BYTES };
        request.send(json.map(ToString::to_string).as_deref())
    }

    fn info(&self, deadline: Instant) -> Result<WledInfo, RigError> {
        let info =
            WledInfo::parse(&self.send("json/info", None, deadline)?).map_err(|error| self.error(error))?;
        let (count, stop) = (info.leds.count, self.settings.strip.stop());
        if count < u32::from(stop) {
            return Err(self.error(format!("found {count} pixels, wanted at least {stop}")));
        }
        Ok(info)
    }

    fn post(&self, state: &serde_json::Value, deadline: Instant) -> Result<WledState, RigError> {
        WledState::parse(&self.send("json/state", Some(state), deadline)?).map_err(|error| self.error(error))
    }

    /// One complete command: deletes overlapping segments, sets the segment, reads it back, and restarts the timer.
    fn command(&self, level: u8, deadline: Instant) -> Result<(), RigError> {
        // Without fade, stream, and synchronisation of other controllers.
        let command = |segments: Vec<serde_json::Value>| json!({"on": true, "bri": 255, "tt": 0, "v": true, "live": false, "udpn": {"nn": true}, "seg": segments});
        let mut state = self.post(&command(vec![self.settings.segment(level)]), deadline)?;
        let overlapping = self.settings.overlapping_segments(&state);
        if !overlapping.is_empty() {
            let mut segments: Vec<_> = overlapping.iter().map(|id| json!({"id": id, "stop": 0})).collect();
            segments.push(self.settings.segment(level));
            state = self.post(&command(segments), deadline)?;
            if let Some(id) = self.settings.overlapping_segments(&state).first() {
                return Err(self.error(format!("segment {id} lies over the lamp's pixels: delete it")));
            }
        }
        self.settings.confirm(&state, level).map_err(|problem| self.error(problem))?;
        if level > 0 && self.settings.dead_man_min > 0 {
            self.restart_timer(level, deadline)?;
        }
        Ok(())
    }

    /// Reads the state once more: a preset, a button or another program may have reverted what was answered.
    fn confirm_later(&self, level: u8, deadline: Instant) -> Result<(), RigError> {
        thread::sleep(REVERT_PAUSE);
        let state = self.send("json/state", None, deadline)?;
        WledState::parse(&state)
            .and_then(|state| self.settings.confirm(&state, level))
            .map_err(|problem| self.error(format!("after its answer, {problem}")))
    }

    /// Restarts the timer: the controller starts it only on a change from off to on.
    fn restart_timer(&self, level: u8, deadline: Instant) -> Result<(), RigError> {
        let minutes = self.settings.dead_man_min;
        self.post(&json!({"v": true, "nl": {"on": false}}), deadline)?;
        thread::sleep(TIMER_PAUSE);
        let timer = json!({"v": true, "nl": {"on": true, "dur": minutes, "mode": 0, "tbri": 0}});
        let state = self.post(&timer, deadline)?;
        let wanted = 60 * i64::from(minutes);
        if !state.nl.on || !(wanted - 30..=wanted).contains(&state.nl.rem) {
            let Nightlight { on, rem } = state.nl;
            return Err(self.error(format!(
                "found its timer {} with {rem} s left, wanted {wanted} s",
                if on { "on" } else { "off" }
            )));
        }
        self.settings.confirm(&state, level).map_err(|problem| self.error(problem))
    }
}

impl Switch for OpenWledLamp {
    fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
        self.dim(if is_on { FULL } else { 0 })
    }

    fn dim(&mut self, level: u8) -> Result<(), RigError> {
        let deadline = Instant::now() + self.settings.timeout_s.duration();
        let mut before = self.info(deadline)?;
        loop {
            self.command(level, deadline)?;
            let after = self.info(deadline)?;
            if after.live {
                return Err(self.error("another program streams to it".to_owned()));
            }
            // A restart meanwhile has deleted the segments.
            if after.uptime >= before.uptime {
                return self.confirm_later(level, deadline);
            }
            before = after;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::{Arc, Mutex};

    use serde_json::Value;

    use super::*;
    use crate::http::tests::{device, reply};
    use crate::switch::Interlock;
    use tropism::lamps::Light;
    use tropism::lighting::{Allowed, Lighting};
    use tropism::rig::Lamps;

    /// A WLED controller as the documentation describes it, with 288 pixels.
    struct Controller {
        on: bool,
        bri: u64,
        segments: BTreeMap<u64, Value>,
        uptime: u64,
        live: bool,
        is_deaf: bool,
        timer: Option<i64>,
        /// When the timer was last switched off, which the controller notices 100 ms later.
        timer_off: Instant,
        /// Switches over by itself before this many further requests about its state.
        reverts_in: Option<usize>,
        /// Restarts after this many further requests.
        restarts_in: Option<usize>,
        /// Which pixels were lit after each request.
        lit: Vec<Vec<bool>>,
        /// Brightness of the first two segments after each request, 0 if they are off.
        brightness: Vec<[u64; 2]>,
    }

    impl Controller {
        /// As it boots: everything is one orange segment.
        fn boots(&mut self) {
            let all = json!({"id": 0, "start": 0, "stop": 288, "on": true, "bri": 255, "fx": 0,
                             "col": [[255, 160, 0], [0, 0, 0], [0, 0, 0]]});
            (self.on, self.bri, self.uptime) = (true, 128, 0);
            self.segments = BTreeMap::from([(0, all)]);
            self.timer = None;
        }

        fn apply(&mut self, state: &Value) {
            self.on = state["on"].as_bool().unwrap_or(self.on);
            self.bri = state["bri"].as_u64().unwrap_or(self.bri);
            for segment in state["seg"].as_array().into_iter().flatten() {
                let id = segment["id"].as_u64().unwrap();
                if segment["stop"] == 0 {
                    self.segments.remove(&id);
                    continue;
                }
                let known = self.segments.entry(id).or_insert_with(|| json!({}));
                for (key, value) in segment.as_object().unwrap() {
                    known[key] = value.clone();
                }
            }
            match state["nl"]["on"].as_bool() {
                Some(false) if self.timer.is_some() => {
                    self.timer = None;
                    self.timer_off = Instant::now();
                }
                // Seen only if it was seen off.
                Some(true)
                    if self.timer.is_none() && self.timer_off.elapsed() > Duration::from_millis(100) =>
                {
                    self.timer = state["nl"]["dur"].as_i64().map(|minutes| 60 * minutes);
                }
                _ => {}
            }
        }

        fn state(&self) -> Value {
            json!({"on": self.on, "bri": self.bri, "transition": 7, "ps": -1,
                   "nl": {"on": self.timer.is_some(), "dur": 12, "mode": 0, "tbri": 0, "rem": self.timer.unwrap_or(-1)},
                   "seg": self.segments.values().collect::<Vec<_>>()})
        }

        fn lit(&self) -> Vec<bool> {
            let covers = |segment: &Value, pixel: u64| {
                self.on
                    && segment["on"] == true
                    && (segment["start"].as_u64().unwrap()..segment["stop"].as_u64().unwrap())
                        .contains(&pixel)
            };
            (0..288).map(|pixel| self.segments.values().any(|segment| covers(segment, pixel))).collect()
        }

        fn answer(&mut self, line: &str, body: &str) -> Value {
            self.uptime += 1;
            if let Some(left) = &mut self.restarts_in {
                *left -= 1;
                if *left == 0 {
                    self.restarts_in = None;
                    self.boots();
                }
            }
            if line.starts_with("GET /json/info ") {
                return json!({"ver": "16.0", "leds": {"count": 288, "pwr": 1000, "maxpwr": 5000},
                              "uptime": self.uptime, "live": self.live, "wifi": {"signal": 80}});
            }
            if let Some(left) = &mut self.reverts_in {
                *left -= 1;
                if *left == 0 {
                    self.reverts_in = None;
                    self.on = !self.on;
                }
            }
            if line.starts_with("GET /json/state ") {
                return self.state();
            }
            assert!(line.starts_with("POST /json/state "), "{line}");
            if !self.is_deaf {
                self.apply(&serde_json::from_str(body).unwrap());
            }
            let lit = self.lit();
            self.lit.push(lit);
            let of = |id: u64| self.segments.get(&id).filter(|segment| self.on && segment["on"] == true);
            self.brightness
                .push([0, 1].map(|id| of(id).and_then(|segment| segment["bri"].as_u64()).unwrap_or(0)));
            self.state()
        }
    }

    fn controller() -> (String, Arc<Mutex<Controller>>) {
        let mut controller = Controller {
            on: true,
            bri: 128,
            segments: BTreeMap::new(),
            uptime: 1000,
            live: false,
            is_deaf: false,
            timer: None,
            timer_off: Instant::now() - Duration::from_secs(1),
            reverts_in: None,
            restarts_in: None,
            lit: Vec::new(),
            brightness: Vec::new(),
        };
        controller.boots();
        let controller = Arc::new(Mutex::new(controller));
        let answering = Arc::clone(&controller);
        let url = device(move |_, asked, socket| {
            let answer = answering.lock().unwrap().answer(&asked.line, &asked.body);
            reply(socket, answer.to_string().as_bytes());
        });
        (url, controller)
    }

    fn lamp(url: &str, segment: u8, more: &str) -> Box<dyn Switch> {
        lamp_of(144, url, segment, more)
    }

    fn lamp_of(pixels: u16, url: &str, segment: u8, more: &str) -> Box<dyn Switch> {
        let first = 144 * u16::from(segment);
        let text = format!(
            "url = {url:?}\nsegment = {segment}\nstrip = {{ first = {first}, pixels = {pixels}, max_amps = 9.0 }}\n{more}"
        );
        let settings: WledLamp = toml::from_str(&text).unwrap();
        settings.check(5.0).unwrap();
        settings.open("lamp", None).unwrap()
    }

    /// Which of the two lamps is lit, all of its pixels alike.
    fn lit(controller: &Mutex<Controller>) -> [bool; 2] {
        let lit = controller.lock().unwrap().lit();
        [0, 144].map(|first| {
            assert!(lit[first..first + 144].iter().all(|&is_lit| is_lit == lit[first]));
            lit[first]
        })
    }

    #[test]
    fn a_controller_that_reverts_after_its_answer_is_noticed() {
        let (url, controller) = controller();
        let mut left = lamp(&url, 0, "dead_man_min = 0");
        left.switch(true).unwrap();
        // The first request about its state is the command, the second one reads it again.
        controller.lock().unwrap().reverts_in = Some(2);
        let error = left.switch(true).unwrap_err().to_string();
        assert!(error.contains("after its answer, it is off, and should be on"), "{error}");
    }

    #[test]
    fn two_lamps_on_one_controller_that_has_just_booted() {
        let (url, controller) = controller();
        let mut lamps = Interlock::new(
            [lamp(&url, 0, "dead_man_min = 0"), lamp(&url, 1, "dead_man_min = 0")],
            Duration::from_millis(1),
        );
        for light in [Light::LEFT, Light::RIGHT, Light::RIGHT, Light::LEFT] {
            lamps.light(Some(light)).unwrap();
            assert_eq!(lit(&controller), Light::BOTH.map(|side| side == light));
        }
        lamps.light(None).unwrap();
        assert_eq!(lit(&controller), [false; 2]);
        // After the first commands, which undo what the boot lit, never a pixel of each.
        let history = &controller.lock().unwrap().lit;
        assert!(history.iter().skip(4).all(|lit| !(lit[0] && lit[287])));
    }

    #[test]
    fn two_lamps_at_levels_stay_within_their_budget() {
        let (url, controller) = controller();
        let mut lamps = Interlock::new(
            [lamp(&url, 0, "dead_man_min = 0"), lamp(&url, 1, "dead_man_min = 0")],
            Duration::ZERO,
        )
        .allowing(Allowed::Any { most_lit: 2, budget: 1.0 });
        let both = |left, right| Lighting::DARK.with(Light::LEFT, left).with(Light::RIGHT, right);
        lamps.light(None).unwrap();
        controller.lock().unwrap().brightness.clear();
        for lighting in [both(255, 0), both(55, 200), both(155, 100), both(0, 255)] {
            lamps.shine(lighting).unwrap();
            // Half duty by default.
            let found = controller.lock().unwrap().brightness.last().copied().unwrap();
            for (light, found) in Light::BOTH.into_iter().zip(found) {
                assert!((2 * found).abs_diff(lighting.level(light).into()) <= 1, "{light}: {found}");
            }
        }
        // Each level is rounded to whole numbers.
        let brightness = &controller.lock().unwrap().brightness;
        assert!(brightness.iter().all(|[left, right]| left + right <= 129), "{brightness:?}");
    }

    #[test]
    fn a_controller_that_forgets_its_segments_is_told_again() {
        let (url, controller) = controller();
        let mut left = lamp(&url, 0, "dead_man_min = 0");
        left.switch(true).unwrap();
        controller.lock().unwrap().boots();
        left.switch(true).unwrap();
        assert_eq!(controller.lock().unwrap().lit().iter().filter(|&&is_lit| is_lit).count(), 144);
        // Between the command and the question whether it has restarted.
        controller.lock().unwrap().restarts_in = Some(3);
        left.switch(false).unwrap();
        assert_eq!(controller.lock().unwrap().restarts_in, None);
        assert!(!controller.lock().unwrap().lit()[0]);
    }

    #[test]
    fn the_timer_in_the_controller_starts_anew_at_every_command() {
        let (url, controller) = controller();
        let mut left = lamp(&url, 0, "");
        left.switch(true).unwrap();
        assert_eq!(controller.lock().unwrap().timer, Some(720));
        controller.lock().unwrap().timer = Some(420);
        left.switch(true).unwrap();
        assert_eq!(controller.lock().unwrap().timer, Some(720));
    }

    #[test]
    fn a_controller_that_does_not_do_as_it_says_is_found_out() {
        let (url, controller) = controller();
        let mut left = lamp(&url, 0, "");
        left.switch(true).unwrap();
        controller.lock().unwrap().is_deaf = true;
        let error = left.switch(false).unwrap_err().to_string();
        assert!(error.contains("it is on, and should be off") && error.contains(&url), "{error}");
        let error = lamp(&url, 0, "dead_man_min = 200").switch(true).unwrap_err().to_string();
        assert!(error.contains("720 s left, wanted 12000 s"), "{error}");
        controller.lock().unwrap().is_deaf = false;
        controller.lock().unwrap().live = true;
        assert!(left.switch(true).unwrap_err().to_string().contains("another program streams"));
        let mut long = lamp_of(200, &url, 1, "");
        assert!(long.switch(true).unwrap_err().to_string().contains("found 288 pixels, wanted at least 344"));
    }

    #[test]
    fn answers_of_something_else_are_refused() {
        for answer in ["", "<html>", "{\"success\":true}", "{\"on\":true,\"bri\":300,\"seg\":[]}"] {
            assert!(WledState::parse(answer.as_bytes()).unwrap_err().contains("not WLED's"), "{answer}");
        }
        let settings: WledLamp = toml::from_str("url = \"http://w\"\nstrip = { pixels = 4 }").unwrap();
        let confirm = |segment: &str| {
            let state = format!("{{\"on\":true,\"bri\":255,\"seg\":[{segment}]}}");
            settings.confirm(&WledState::parse(state.as_bytes()).unwrap(), FULL)
        };
        assert!(confirm("").unwrap_err().contains("no segment 0"));
        assert!(confirm("{\"start\":0,\"stop\":9,\"on\":true}").unwrap_err().contains("to 9, wanted 0 to 4"));
        let dim = "{\"start\":0,\"stop\":4,\"on\":true,\"bri\":7,\"fx\":0,\"col\":[[255,255,255]]}";
        assert!(confirm(dim).unwrap_err().contains("255 x 7"));
        assert_eq!(confirm(&dim.replace(":7,", ":128,")), Ok(()));
    }

    #[test]
    fn a_timer_that_would_run_out_between_steps_is_refused() {
        let settings: WledLamp = toml::from_str("url = \"http://w\"\nstrip = { pixels = 4 }").unwrap();
        assert_eq!(settings.check(5.0), Ok(()));
        assert!(settings.check(6.0).unwrap_err().contains("dead_man_min = 12"));
    }
}
