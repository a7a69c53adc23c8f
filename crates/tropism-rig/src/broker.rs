//! The MQTT broker of a tent, and connections to it.

use std::path::{Path, PathBuf};

use rumqttc::{Client, Connection, MqttOptions};
use serde::{Deserialize, Serialize};
use tropism::rig::RigError;

use crate::failed;
use crate::secret::read_secret;

/// The MQTT broker of a tent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Broker {
    /// Host name or address.
    pub host: String,
    /// Its port.
    #[serde(default = "port", deserialize_with = "crate::whole::port")]
    pub port: u16,
    /// User name, if the broker asks for one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub username: Option<String>,
    /// A file whose first line is the password, so that it stays out of run folders.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub password_file: Option<PathBuf>,
    /// The certificate of the authority that signed the broker's, in PEM. With it the connection is encrypted; such brokers
    /// listen on port 8883. For a broker on the Internet it is the system's own list, such as
    /// `/etc/ssl/certs/ca-certificates.crt`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ca_file: Option<PathBuf>,
    /// What its files hold, once they were read.
    #[serde(skip)]
    secrets: Option<Secrets>,
}

/// What the files of a broker hold.
#[derive(Clone, PartialEq)]
struct Secrets {
    password: Option<String>,
    ca: Option<Vec<u8>>,
}

impl std::fmt::Debug for Secrets {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Secrets")
    }
}

impl Broker {
    /// A broker without user and encryption.
    #[must_use]
    pub fn new(host: &str, port: u16) -> Self {
        let host = host.to_owned();
        Self { host, port, username: None, password_file: None, ca_file: None, secrets: None }
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// What was found, and what is wanted; without the feature `tls`, `ca_file` is refused.
    pub fn check(&self) -> Result<(), String> {
        if !cfg!(feature = "tls") && self.ca_file.is_some() {
            return Err("mqtt: ca_file needs the feature `tls`".to_owned());
        }
        let host = self.host.trim_start_matches('[').trim_end_matches(']');
        let is_foreign =
            |letter: char| letter.is_whitespace() || letter.is_control() || "/@".contains(letter);
        let is_host = !host.is_empty()
            && !host.contains(is_foreign)
            && (!host.contains(':') || host.parse::<std::net::Ipv6Addr>().is_ok());
        if !is_host {
            return Err(format!(
                "mqtt: found host = {:?}, wanted a name or an address alone: the port is `port`, the user `username`",
                self.host
            ));
        }
        Ok(())
    }

    /// The broker with what its files hold, so that the disk is not needed later.
    ///
    /// # Errors
    /// [`RigError::Device`] if one cannot be read.
    pub fn opened(&self) -> Result<Self, RigError> {
        let mut opened = self.clone();
        if opened.secrets.is_none() {
            let ca = self.ca_file.as_deref().map(read_file).transpose()?;
            let password = self.password_file.as_deref().map(read_secret).transpose()?;
            opened.secrets = Some(Secrets { password, ca });
        }
        Ok(opened)
    }

    /// A connection under the name `client`, for at most `waiting` requests at once; `set` sets more of its options. A broker
    /// that was not [opened](Self::opened) gets no password, and is not trusted with encryption.
    pub(crate) fn connect(
        &self,
        client: String,
        waiting: usize,
        set: impl FnOnce(&mut MqttOptions),
    ) -> (Client, Connection) {
        let mut options = MqttOptions::new(client, (self.host.clone(), self.port));
        options.set_clean_session(true);
        let secrets = self.secrets.as_ref();
        if let Some(username) = &self.username {
            let password = secrets.and_then(|secrets| secrets.password.clone());
            options.set_credentials(username, password.unwrap_or_default());
        }
        #[cfg(feature = "tls")]
        if self.ca_file.is_some() {
            let ca = secrets.and_then(|secrets| secrets.ca.clone()).unwrap_or_default();
            options.set_transport(rumqttc::Transport::tls(ca, None, None));
        }
        set(&mut options);
        Client::builder(options).capacity(waiting).build()
    }
}

fn read_file(path: &Path) -> Result<Vec<u8>, RigError> {
    std::fs::read(path)
        .map_err(|error| failed(path.display().to_string(), format!("cannot be read: {error}")))
}

const fn port() -> u16 {
    1883
}
