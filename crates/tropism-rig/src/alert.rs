//! Telling people: what happens to a run goes out by ntfy, webhook, MQTT or a program, and a heartbeat as long as it lives.
//!
//! Each channel has a thread of its own, so that a network that hangs never delays a step. What could not be delivered is
//! tried again, after ten seconds at first and ten minutes at most; what happens shortly after a message waits a minute and
//! goes out together. A heartbeat is one GET after a step, and silence is what alarms: whoever expects it (healthchecks.io,
//! Uptime Kuma) also notices that the computer is dead.
//!
//! # References
//! ntfy, "Publishing": <https://docs.ntfy.sh/publish/>. Healthchecks, "Pinging API":
//! <https://healthchecks.io/docs/http_api/>.

mod channel;
mod broker;

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tropism::rig::EventKind;
use tropism::rig::RigError;

use crate::child::run;
use crate::clock::{SystemTimes, Time};
use crate::failed;
use crate::http::{check_url, read_secret};
use crate::mqtt::Broker;
use crate::seconds::{Seconds, ten, twenty};
use channel::{Channel, Pace};

/// What kind of thing happened: what a run's journal knows, and some more. In files and messages, one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum Kind {
    /// It stands in the journal.
    Event(EventKind),
    /// The run ended by an error.
    Fault,
    /// A step is over: what heartbeats and the status at a broker are made of.
    Step,
    /// Somebody tries whether messages arrive.
    Test,
}

impl Kind {
    /// Every kind.
    pub fn all() -> impl Iterator<Item = Self> {
        EventKind::ALL.into_iter().map(Self::Event).chain([Self::Fault, Self::Step, Self::Test])
    }

    /// The word in files and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Event(kind) => kind.name(),
            Self::Fault => "fault",
            Self::Step => "step",
            Self::Test => "test",
        }
    }

    /// Whether people are told of it if they do not choose: not of what happens once and passes.
    #[must_use]
    pub const fn is_told(self) -> bool {
        use EventKind::{Camera, Dark, Held, Late};
        !matches!(self, Self::Event(Late | Camera | Dark | Held) | Self::Step)
    }

    /// Whether somebody should come.
    const fn is_urgent(self) -> bool {
        use EventKind::{Computer, Damaged, Disk, Lamp, Lost, Mismatch, Paused};
        matches!(self, Self::Event(Paused | Lost | Lamp | Mismatch | Computer | Disk | Damaged) | Self::Fault)
    }
}

impl From<EventKind> for Kind {
    fn from(kind: EventKind) -> Self {
        Self::Event(kind)
    }
}

impl From<Kind> for &'static str {
    fn from(kind: Kind) -> Self {
        kind.name()
    }
}

impl FromStr for Kind {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        Self::all().find(|kind| kind.name() == word).ok_or_else(|| {
            let names: Vec<_> = Self::all().map(Self::name).collect();
            format!("found {word:?}, wanted one of {}", names.join(", "))
        })
    }
}

impl TryFrom<String> for Kind {
    type Error = String;

    fn try_from(word: String) -> Result<Self, String> {
        word.parse()
    }
}

/// Something that happened to a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Happening {
    /// What kind of thing.
    pub kind: Kind,
    /// At which step.
    pub step: Option<u32>,
    /// In words.
    pub text: String,
    /// When, in seconds since 1970.
    pub unix_s: f64,
}

impl Happening {
    /// Something that happens now.
    #[must_use]
    pub fn now(kind: impl Into<Kind>, step: Option<u32>, text: impl Into<String>) -> Self {
        Self { kind: kind.into(), step, text: text.into(), unix_s: SystemTimes.unix_s() }
    }

    /// As a line for people, who read it `late_s` seconds after it happened.
    fn line(&self, late_s: f64) -> String {
        let step = self.step.map_or_else(String::new, |step| format!(", step {step}"));
        let late = match late_s {
            60.0.. => format!(" ({:.0} min ago)", late_s / 60.0),
            _ => String::new(),
        };
        format!("{}{step}: {}{late}", self.kind.name(), self.text)
    }

    /// As an object for programs.
    fn json(&self, run: &str) -> serde_json::Value {
        serde_json::json!({
            "schema": "tropism.alert/1", "run": run, "kind": self.kind, "step": self.step,
            "text": self.text, "unix_s": self.unix_s,
        })
    }
}

/// A POST for each message, of lines to an ntfy server or of JSON to any other. Where the address is the secret, a file
/// holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Post {
    /// Where to, such as `https://ntfy.sh/my-topic`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// A file whose first line is the address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url_file: Option<PathBuf>,
    /// A file whose first line is sent as the header `Authorization`, such as `Bearer tk_…`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub authorization_file: Option<PathBuf>,
    /// What is told; all but what happens once and passes if it is left out.
    #[serde(default = "told")]
    pub on: Vec<Kind>,
    /// Seconds until a try is given up.
    #[serde(default = "ten")]
    pub timeout_s: Seconds,
}

/// A GET after each step, at most one a minute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Heartbeat {
    /// Where to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// A file whose first line is the address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url_file: Option<PathBuf>,
    /// Seconds until a try is given up.
    #[serde(default = "ten")]
    pub timeout_s: Seconds,
}

/// The rig's broker: what goes on is kept in `TOPIC/status`, and each message passes through `TOPIC/event`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MqttAlert {
    /// Such as `tropism/bean`.
    pub topic: String,
    /// What is told; all but what happens once and passes if it is left out.
    #[serde(default = "told")]
    pub on: Vec<Kind>,
}

/// A program that is run for each message, with two more words: the kind and the text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandAlert {
    /// Program and first arguments.
    pub command: Vec<String>,
    /// What is told; all but what happens once and passes if it is left out.
    #[serde(default = "told")]
    pub on: Vec<Kind>,
    /// Seconds until it is killed.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
}

fn told() -> Vec<Kind> {
    Kind::all().filter(|kind| kind.is_told()).collect()
}

fn check_address(url: Option<&str>, file: Option<&Path>) -> Result<(), String> {
    match (url, file) {
        (Some(url), None) => check_url(url),
        (None, Some(_)) => Ok(()),
        _ => Err("found both or neither of url and url_file, wanted one of them".to_owned()),
    }
}

/// A channel as a rig file names it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Settings<'a> {
    Ntfy(&'a Post),
    Webhook(&'a Post),
    Heartbeat(&'a Heartbeat),
    Mqtt(&'a MqttAlert),
    Command(&'a CommandAlert),
}

impl Settings<'_> {
    pub(crate) fn check(self) -> Result<(), String> {
        match self {
            Self::Ntfy(Post { url, url_file, .. })
            | Self::Webhook(Post { url, url_file, .. })
            | Self::Heartbeat(Heartbeat { url, url_file, .. }) => {
                check_address(url.as_deref(), url_file.as_deref())
            }
            Self::Mqtt(MqttAlert { topic, .. }) => {
                if topic.is_empty() || topic.contains(['+', '#', '\0']) || topic.len() > 1000 {
                    return Err(format!("found topic {topic:?}, wanted one without + and #"));
                }
                Ok(())
            }
            Self::Command(CommandAlert { command, .. }) if command.is_empty() => {
                Err("found an empty command, wanted a program".to_owned())
            }
            Self::Command(_) => Ok(()),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Ntfy(_) => "ntfy",
            Self::Webhook(_) => "webhook",
            Self::Heartbeat(_) => "heartbeat",
            Self::Mqtt(_) => "mqtt",
            Self::Command(_) => "command",
        }
    }

    fn on(self) -> Vec<Kind> {
        match self {
            Self::Heartbeat(_) => vec![Kind::Step],
            Self::Ntfy(Post { on, .. })
            | Self::Webhook(Post { on, .. })
            | Self::Mqtt(MqttAlert { on, .. })
            | Self::Command(CommandAlert { on, .. }) => on.clone(),
        }
    }

    /// The channel without its thread; its secrets are read now. A broker has no such.
    fn deliver(self, run: &str) -> Result<Option<Deliver>, RigError> {
        let secret = |file: &Option<PathBuf>| file.as_deref().map(read_secret).transpose();
        let address = |url: &Option<String>, file: &Option<PathBuf>| match (url, file) {
            (Some(url), _) => Ok(url.clone()),
            (None, Some(file)) => {
                let url = read_secret(file)?;
                // Not shown: it is a secret.
                check_url(&url).map(|()| url).map_err(|_| {
                    failed(file.display().to_string(), "found no address in its first line, wanted one")
                })
            }
            (None, None) => Err(failed(self.name(), "found no address, wanted one")),
        };
        let run = run.to_owned();
        Ok(match self {
            Self::Ntfy(post) | Self::Webhook(post) => {
                let (url, authorization) =
                    (address(&post.url, &post.url_file)?, secret(&post.authorization_file)?);
                let timeout = post.timeout_s.duration();
                Some(match self {
                    Self::Ntfy(_) => Deliver::Ntfy { url, authorization, timeout, run },
                    _ => Deliver::Webhook { url, authorization, timeout, run },
                })
            }
            Self::Heartbeat(Heartbeat { url, url_file, timeout_s }) => {
                Some(Deliver::Heartbeat { url: address(url, url_file)?, timeout: timeout_s.duration() })
            }
            Self::Command(CommandAlert { command, timeout_s, .. }) => {
                Some(Deliver::Command { command: command.clone(), timeout: timeout_s.duration() })
            }
            Self::Mqtt(_) => None,
        })
    }
}

/// How messages leave.
#[derive(Clone, Debug)]
enum Deliver {
    Ntfy { url: String, authorization: Option<String>, timeout: Duration, run: String },
    Webhook { url: String, authorization: Option<String>, timeout: Duration, run: String },
    Heartbeat { url: String, timeout: Duration },
    Command { command: Vec<String>, timeout: Duration },
}

/// The most lines of one message.
const LINES: usize = 20;

impl Deliver {
    /// Sends what happened, all in one message where people read it.
    ///
    /// # Errors
    /// What went wrong, without the address: it may be a secret.
    fn deliver(&self, happenings: &[Happening]) -> Result<(), String> {
        let now = SystemTimes.unix_s();
        let mut lines: Vec<_> =
            happenings.iter().take(LINES).map(|happening| happening.line(now - happening.unix_s)).collect();
        if happenings.len() > LINES {
            lines.push(format!("and {} more", happenings.len() - LINES));
        }
        let Some(worst) =
            happenings.iter().map(|happening| happening.kind).max_by_key(|kind| kind.is_urgent())
        else {
            return Ok(());
        };
        match self {
            Self::Ntfy { url, authorization, timeout, run } => {
                let priority = if worst.is_urgent() { "high" } else { "default" };
                let request = post(url, authorization.as_deref(), *timeout)
                    .header("Title", format!("tropism: {}", worst.name()))
                    .header("Priority", priority);
                answered(request.send(format!("{run}\n{}", lines.join("\n"))))
            }
            Self::Webhook { url, authorization, timeout, run } => {
                for happening in happenings {
                    let request = post(url, authorization.as_deref(), *timeout)
                        .header("Content-Type", "application/json");
                    answered(request.send(happening.json(run).to_string()))?;
                }
                Ok(())
            }
            Self::Heartbeat { url, timeout } => answered(agent(*timeout).get(url).call()),
            Self::Command { command, timeout } => {
                let words = [&command[..], &[worst.name().to_owned(), lines.join("\n")]].concat();
                run(&command[0], &words, *timeout).map(drop).map_err(|error| error.to_string())
            }
        }
    }
}

fn agent(timeout: Duration) -> ureq::Agent {
    ureq::Agent::config_builder().timeout_global(Some(timeout)).max_redirects(3).build().new_agent()
}

fn post(
    url: &str,
    authorization: Option<&str>,
    timeout: Duration,
) -> ureq::RequestBuilder<ureq::typestate::WithBody> {
    let request = agent(timeout).post(url);
    match authorization {
        Some(value) => request.header("Authorization", value),
        None => request,
    }
}

fn answered(answer: Result<ureq::http::Response<ureq::Body>, ureq::Error>) -> Result<(), String> {
    answer.map(drop).map_err(|error| error.to_string())
}

/// The channels of a run.
#[derive(Debug, Default)]
pub struct Alerts {
    channels: Vec<Channel>,
}

impl Alerts {
    /// Opens all channels; `run` is the run's name, `broker` the rig's.
    ///
    /// # Errors
    /// [`RigError::Device`] if a secret cannot be read, or there is no broker. Nothing is sent yet but by MQTT, so a
    /// network that is down is no error.
    pub(crate) fn open<'a>(
        settings: impl Iterator<Item = Settings<'a>>,
        broker: Option<&Broker>,
        run: &str,
    ) -> Result<Self, RigError> {
        let open = |settings: Settings<'_>| {
            let (name, on) = (settings.name(), settings.on());
            match (settings.deliver(run)?, settings) {
                (Some(deliver), _) => {
                    let pace = if name == "heartbeat" { Pace::HEARTBEAT } else { Pace::MESSAGES };
                    Ok(Channel::start(name, on, pace, move |happenings| deliver.deliver(happenings)))
                }
                (None, Settings::Mqtt(alert)) => {
                    let broker = broker.ok_or_else(|| {
                        failed("alert (mqtt)", "found no [mqtt], wanted the host of the broker")
                    })?;
                    broker::start(broker, alert, run)
                }
                (None, _) => Err(failed(name, "found no way out, wanted one")),
            }
        };
        Ok(Self { channels: settings.map(open).collect::<Result<_, _>>()? })
    }

    /// Tells all channels that want to know. Returns at once.
    pub fn tell(&self, happening: &Happening) {
        for channel in &self.channels {
            channel.tell(happening);
        }
    }

    /// Ends all channels: what waits is tried once more. Returns the name of each channel that has something left, and
    /// what was wrong with it; after half a minute, what hangs is left behind.
    #[must_use]
    pub fn close(self) -> Vec<(&'static str, String)> {
        // All are told first, so that their last tries go side by side.
        let ending: Vec<_> = self.channels.into_iter().map(Channel::end).collect();
        ending.into_iter().filter_map(channel::Ending::wait).collect()
    }
}

#[cfg(test)]
mod tests;
