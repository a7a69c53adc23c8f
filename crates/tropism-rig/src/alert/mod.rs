//! Alerts: events of a run go out by ntfy, webhook, MQTT or a program, and a heartbeat shows that the run is alive.
//!
//! Each channel has its own thread, so that a network that hangs never delays a step. Failed messages are repeated after
//! 10 s at first and 10 min at most; events within a minute after a message go out together. A heartbeat is one GET after a
//! step: a service that expects it (healthchecks.io, Uptime Kuma) also notices a dead computer.
//!
//! # References
//! ntfy, "Publishing": <https://docs.ntfy.sh/publish/>. Healthchecks, "Pinging API":
//! <https://healthchecks.io/docs/http_api/>.

mod channel;
mod discovery;
mod broker;
mod origin;

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tropism::rig::EventKind;
use tropism::rig::RigError;
use tropism::text::plain;

use crate::broker::Broker;
use crate::child::run;
use crate::clock::{SystemTimes, Time};
use crate::failed;
use crate::http::{check_url, check_url_shown, in_plain_words};

use crate::seconds::{Seconds, ten, twenty};
use crate::secret::{host_alone, hosts_alone, read_secret, redacted_text};
use channel::{Channel, Pace};
pub use origin::OF_STUDIO;
pub(crate) use origin::{Origin, check_page};

/// Kind of an event: the kinds of the journal, and two more. One word in files and messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "String", into = "&'static str")]
pub enum Kind {
    /// An event of the journal.
    Event(EventKind),
    /// A step is complete: sent as heartbeat and as status.
    Step,
    /// A test message.
    Test,
}

impl Kind {
    /// Every kind.
    pub fn all() -> impl Iterator<Item = Self> {
        EventKind::ALL.into_iter().map(Self::Event).chain([Self::Step, Self::Test])
    }

    /// The word in files and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Event(kind) => kind.name(),
            Self::Step => "step",
            Self::Test => "test",
        }
    }

    /// Whether a channel without `on` sends it. Events that pass by themselves are left out, and what people wrote.
    #[must_use]
    pub const fn is_default(self) -> bool {
        use EventKind::{Camera, CarriedForward, Dark, Late, Note};
        !matches!(self, Self::Event(Late | Camera | Dark | CarriedForward | Note) | Self::Step)
    }

    /// Whether a person must act.
    const fn is_urgent(self) -> bool {
        use EventKind::{Computer, Damaged, Disk, Fault, Lamp, Lost, Mismatch, Paused};
        matches!(self, Self::Event(Paused | Fault | Lost | Lamp | Mismatch | Computer | Disk | Damaged))
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

/// An event of a run, as it is sent.
#[derive(Clone, Debug, PartialEq)]
pub struct AlertEvent {
    /// Kind of the event.
    pub kind: Kind,
    /// Step, if the event belongs to one.
    pub step: Option<u32>,
    /// Description.
    pub text: String,
    /// Time, in seconds since 1970.
    pub unix_s: f64,
    /// What is known of the plant, if a step is complete.
    pub seen: Option<Seen>,
}

/// A plant and its light at a step, for who watches it from afar.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Seen {
    /// The tip, in cm to the right of the root.
    pub tip_x_cm: f64,
    /// The tip, in cm above the soil.
    pub tip_y_cm: f64,
    /// The lamps that are lit, by their names.
    pub lamp: String,
    /// When the next photograph is due, in seconds since 1970.
    pub next_unix_s: f64,
    /// File of the photograph.
    #[serde(skip)]
    pub photograph: PathBuf,
}

impl AlertEvent {
    /// An event at the present time.
    #[must_use]
    pub fn now(kind: impl Into<Kind>, step: Option<u32>, text: impl Into<String>) -> Self {
        Self { kind: kind.into(), step, text: text.into(), unix_s: SystemTimes.unix_s(), seen: None }
    }

    /// The description as others may read it: without secrets of addresses and controls of terminals.
    fn shown(&self) -> String {
        plain(&redacted_text(&self.text)).into_owned()
    }

    /// A line of text that is read `late_s` seconds after the event.
    fn line(&self, late_s: f64) -> String {
        let step = self.step.map_or_else(String::new, |step| format!(", step {step}"));
        let late = match late_s {
            60.0.. => format!(" ({:.0} min ago)", late_s / 60.0),
            _ => String::new(),
        };
        format!("{}{step}: {}{late}", self.kind.name(), self.shown())
    }

    /// A JSON object.
    fn json(&self, Origin { run, url }: &Origin) -> serde_json::Value {
        let mut object = serde_json::json!({
            "schema": "tropism.alert/1", "run": run, "kind": self.kind, "step": self.step,
            "text": self.shown(), "unix_s": self.unix_s,
        });
        if let Some(url) = url {
            object["url"] = url.as_str().into();
        }
        object
    }
}

/// Settings of a channel that sends a POST: text to an ntfy server, JSON to a webhook. A secret address lies in a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Post {
    /// Address, such as `https://ntfy.sh/my-topic`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// A file whose first line is the address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url_file: Option<PathBuf>,
    /// A file whose first line is sent as the header `Authorization`, such as `Bearer tk_…`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub authorization_file: Option<PathBuf>,
    /// Kinds that are sent. If it is left out: [`Kind::is_default`].
    #[serde(default = "default_kinds")]
    pub on: Vec<Kind>,
    /// Time limit of one attempt.
    #[serde(default = "ten")]
    pub timeout_s: Seconds,
}

/// Settings of a heartbeat: a GET after each step, at most one a minute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Heartbeat {
    /// Address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// A file whose first line is the address.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url_file: Option<PathBuf>,
    /// Time limit of one attempt.
    #[serde(default = "ten")]
    pub timeout_s: Seconds,
}

/// Settings of a channel to the rig's broker: `TOPIC/status` and `TOPIC/photograph` are retained, `TOPIC/event` has each event.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MqttAlert {
    /// Start of the topics, such as `tropism/bean`.
    pub topic: String,
    /// First part of the topics by which Home Assistant discovers devices, `homeassistant` in most houses. With it the run
    /// announces itself, sends its photographs, and a message `stop` in `TOPIC/command` ends it in order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub discovery: Option<String>,
    /// Kinds that are sent. If it is left out: [`Kind::is_default`].
    #[serde(default = "default_kinds")]
    pub on: Vec<Kind>,
}

/// Settings of a program that runs for each message, with two more arguments: kind and text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CommandAlert {
    /// Program and first arguments.
    pub command: Vec<String>,
    /// Kinds that are sent. If it is left out: [`Kind::is_default`].
    #[serde(default = "default_kinds")]
    pub on: Vec<Kind>,
    /// Seconds until it is killed.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
}

/// The kinds that a channel without `on` sends.
fn default_kinds() -> Vec<Kind> {
    Kind::all().filter(|kind| kind.is_default()).collect()
}

fn check_address(url: Option<&str>, file: Option<&Path>) -> Result<(), String> {
    match (url, file) {
        (Some(url), None) => check_url_shown(url, host_alone),
        (None, Some(_)) => Ok(()),
        _ => Err("either url or url_file must be given, not both".to_owned()),
    }
}

/// The settings of any channel.
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
            Self::Mqtt(MqttAlert { topic, discovery, .. }) => {
                let is_topic = |topic: &str| {
                    !topic.is_empty() && !topic.contains(['+', '#', '\0']) && topic.len() <= 1000
                };
                for (key, topic) in [("topic", Some(topic)), ("discovery", discovery.as_ref())] {
                    if let Some(topic) = topic.filter(|topic| !is_topic(topic)) {
                        return Err(format!("found {key} {topic:?}, wanted one without + and #"));
                    }
                }
                Ok(())
            }
            Self::Command(CommandAlert { command, .. }) if command.is_empty() => {
                Err("the command is empty".to_owned())
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

    /// Reads the secrets and returns the sender of the channel; `None` for MQTT, which holds a connection instead.
    fn sender(self, origin: &Origin) -> Result<Option<Sender>, RigError> {
        let secret = |file: &Option<PathBuf>| file.as_deref().map(read_secret).transpose();
        let address = |url: &Option<String>, file: &Option<PathBuf>| match (url, file) {
            (Some(url), _) => Ok(url.clone()),
            (None, Some(file)) => {
                let url = read_secret(file)?;
                // The address is a secret and is not shown.
                check_url(&url).map(|()| url).map_err(|_| {
                    failed(file.display().to_string(), "its first line is no address that can be used: http://, or https:// with the feature `tls`")
                })
            }
            (None, None) => Err(failed(self.name(), "there is no address")),
        };
        let origin = origin.clone();
        Ok(match self {
            Self::Ntfy(post) | Self::Webhook(post) => {
                let (url, authorization) =
                    (address(&post.url, &post.url_file)?, secret(&post.authorization_file)?);
                let timeout = post.timeout_s.duration();
                Some(match self {
                    Self::Ntfy(_) => Sender::Ntfy { url, authorization, timeout, origin },
                    _ => Sender::Webhook { url, authorization, timeout, origin },
                })
            }
            Self::Heartbeat(Heartbeat { url, url_file, timeout_s }) => {
                Some(Sender::Heartbeat { url: address(url, url_file)?, timeout: timeout_s.duration() })
            }
            Self::Command(CommandAlert { command, timeout_s, .. }) => {
                Some(Sender::Command { command: command.clone(), timeout: timeout_s.duration() })
            }
            Self::Mqtt(_) => None,
        })
    }
}

/// Sends the messages of a channel.
#[derive(Clone, Debug)]
enum Sender {
    Ntfy { url: String, authorization: Option<String>, timeout: Duration, origin: Origin },
    Webhook { url: String, authorization: Option<String>, timeout: Duration, origin: Origin },
    Heartbeat { url: String, timeout: Duration },
    Command { command: Vec<String>, timeout: Duration },
}

/// The largest number of lines of a message: chosen by hand.
const MAX_LINES: usize = 20;

impl Sender {
    /// Sends `events`, in one message where people read it.
    ///
    /// # Errors
    /// The failure, without the address, which may be a secret.
    fn send(&self, events: &[AlertEvent]) -> Result<(), String> {
        let now = SystemTimes.unix_s();
        let mut lines: Vec<_> =
            events.iter().take(MAX_LINES).map(|event| event.line(now - event.unix_s)).collect();
        if events.len() > MAX_LINES {
            lines.push(format!("and {} more", events.len() - MAX_LINES));
        }
        let Some(worst) = events.iter().map(|event| event.kind).max_by_key(|kind| kind.is_urgent()) else {
            return Ok(());
        };
        match self {
            Self::Ntfy { url, authorization, timeout, origin } => {
                let priority = if worst.is_urgent() { "high" } else { "default" };
                let mut request = post(url, authorization.as_deref(), *timeout)
                    .header("Title", format!("tropism: {}", worst.name()))
                    .header("Priority", priority);
                if let Some(page) = &origin.url {
                    request = request.header("Click", page);
                }
                check_answer(request.send(format!("{}\n{}", origin.run, lines.join("\n"))))
            }
            Self::Webhook { url, authorization, timeout, origin } => {
                for event in events {
                    let request = post(url, authorization.as_deref(), *timeout)
                        .header("Content-Type", "application/json");
                    check_answer(request.send(event.json(origin).to_string()))?;
                }
                Ok(())
            }
            Self::Heartbeat { url, timeout } => check_answer(agent(*timeout).get(url).call()),
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

fn check_answer(answer: Result<ureq::http::Response<ureq::Body>, ureq::Error>) -> Result<(), String> {
    answer.map(drop).map_err(|error| plain(&hosts_alone(&in_plain_words(&error.to_string()))).into_owned())
}

/// The alert channels of a run.
#[derive(Debug, Default)]
pub struct Alerts {
    channels: Vec<Channel>,
    /// Whether somebody asked for an end through a channel.
    is_stopped: Arc<AtomicBool>,
}

impl Alerts {
    /// Opens all channels of the run `origin`; `broker` is the rig's.
    ///
    /// # Errors
    /// [`RigError::Device`] if a secret cannot be read, or a channel wants a broker and there is none. A network that is
    /// down is not an error.
    pub(crate) fn open<'a>(
        settings: impl Iterator<Item = Settings<'a>>,
        broker: Option<&Broker>,
        origin: &Origin,
    ) -> Result<Self, RigError> {
        let is_stopped = Arc::new(AtomicBool::new(false));
        let open = |settings: Settings<'_>| {
            let (name, on) = (settings.name(), settings.on());
            match (settings.sender(origin)?, settings) {
                (Some(sender), _) => {
                    let pace = if name == "heartbeat" { Pace::HEARTBEAT } else { Pace::MESSAGES };
                    Ok(Channel::start(name, on, pace, move |events| sender.send(events)))
                }
                (None, Settings::Mqtt(alert)) => {
                    let broker = broker.ok_or_else(|| {
                        failed("alert (mqtt)", "there is no [mqtt], which names the host of the broker")
                    })?;
                    broker::start(broker, alert, origin, Arc::clone(&is_stopped))
                }
                (None, _) => Err(failed(name, "there is no sender")),
            }
        };
        Ok(Self { channels: settings.map(open).collect::<Result<_, _>>()?, is_stopped })
    }

    /// Whether somebody asked for an end of the run through a channel.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::SeqCst)
    }

    /// Passes `event` to all channels that send its kind. Returns at once.
    pub fn send(&self, event: &AlertEvent) {
        for channel in &self.channels {
            channel.send(event);
        }
    }

    /// Ends all channels after one more attempt to send what waits. Returns name and problem of each channel that could not
    /// send everything; a channel that hangs is abandoned after 30 s.
    #[must_use]
    pub fn close(self) -> Vec<(&'static str, String)> {
        // End all of them first, so that their last attempts run in parallel.
        let ending: Vec<_> = self.channels.into_iter().map(Channel::end).collect();
        ending.into_iter().filter_map(channel::Ending::wait).collect()
    }
}

#[cfg(test)]
mod tests;
