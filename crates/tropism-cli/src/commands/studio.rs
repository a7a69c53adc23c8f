//! `tropism studio`: the page.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result};
use clap::Args;
use serde::Serialize;
#[cfg(feature = "tls")]
use tropism_studio::TlsFiles;
use tropism_studio::{StudioPlan, Tokens, Welcome, new_tokens};

use crate::page::{LISTEN, parse_address};
use crate::shell::{Shell, print_line};

/// Serve a page: watch runs and evolutions live, draw a target, look after a plant from a phone
///
/// It serves the runs, evolutions, studies and comparisons below FOLDER. They do not need it: it may end and begin again at
/// any time. On the loopback address everybody on this computer may use it. Any other address asks for a token, which is
/// printed once with a QR code. It is encrypted with a certificate of your own, or by a proxy before it. Work that a page asks
/// for waits in a queue, one heavy job at a time, and goes on when the page or the studio ends.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism studio --demo\n  \
    tropism studio beans --open\n  \
    tropism studio beans --listen 0.0.0.0:8217\n  \
    tropism studio beans --listen 0.0.0.0:8217 --tls-cert certificate.pem --tls-key key.pem\n  \
    tropism studio beans --listen 0.0.0.0:8217 --new-tokens")]
pub(crate) struct Studio {
    /// Folder with runs, evolutions and studies
    #[arg(value_name = "FOLDER", default_value = ".")]
    folder: PathBuf,

    /// Address and port to serve on; another one than loopback asks for a token
    #[arg(long, value_name = "ADDRESS:PORT", default_value = LISTEN, value_parser = parse_address)]
    listen: SocketAddr,

    /// Port to serve on, on this computer alone
    #[arg(long, value_name = "PORT", conflicts_with = "listen")]
    port: Option<u16>,

    /// Certificate with which the page is encrypted, in PEM, with those between it and its root
    #[cfg(feature = "tls")]
    #[arg(long, value_name = "CERTIFICATE.pem", requires = "tls_key")]
    tls_cert: Option<PathBuf>,

    /// Private key of the certificate, in PEM
    #[cfg(feature = "tls")]
    #[arg(long, value_name = "KEY.pem", requires = "tls_cert")]
    tls_key: Option<PathBuf>,

    /// Open the page in a browser
    #[arg(long)]
    open: bool,

    /// Ask for a token on the loopback address, too: behind a proxy everybody comes from there
    #[arg(long)]
    ask_token: bool,

    /// Let nobody change anything
    #[arg(long)]
    read_only: bool,

    /// A further name of this computer in addresses, such as that of a proxy; can be given several times
    #[arg(long, value_name = "NAME")]
    host: Vec<String>,

    /// Show a virtual bean and evolutions that begin now, in a folder that is deleted at the end
    #[arg(long, conflicts_with_all = ["folder", "new_tokens"])]
    demo: bool,

    /// Make new tokens for FOLDER: the old ones open nothing any more
    #[arg(long)]
    new_tokens: bool,
}

/// What is printed with `--json` when pages can be had.
#[derive(Serialize)]
struct Served<'w> {
    schema: &'static str,
    address: &'w str,
    folder: &'w PathBuf,
    asks_for_token: bool,
    certificate_sha256: Option<&'w str>,
    token: Option<&'w str>,
    token_for_looking: Option<&'w str>,
}

impl Studio {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        if self.new_tokens {
            std::fs::metadata(&self.folder).with_context(|| self.folder.display().to_string())?;
            let tokens = new_tokens(&self.folder)?;
            print_line(&token_lines(&tokens));
        }
        let plan = StudioPlan {
            folder: (!self.demo).then_some(self.folder),
            listen: self.port.map_or(self.listen, |port| (std::net::Ipv4Addr::LOCALHOST, port).into()),
            hosts: self.host,
            ask_token: self.ask_token,
            read_only: self.read_only,
            demo: self.demo,
            #[cfg(feature = "tls")]
            tls: self.tls_cert.zip(self.tls_key).map(|(certificate, key)| TlsFiles { certificate, key }),
            program: std::env::current_exe()?,
        };
        let mut printed = Ok(());
        tropism_studio::serve(&plan, |welcome| {
            printed = shell.result(&text(welcome), &served(welcome));
            if self.open {
                open(&welcome.link());
            }
        })?;
        printed
    }
}

fn served(welcome: &Welcome) -> Served<'_> {
    let tokens = welcome.tokens.as_ref();
    Served {
        schema: "tropism.studio/1",
        address: &welcome.address,
        folder: &welcome.folder,
        asks_for_token: welcome.asks_for_token,
        certificate_sha256: welcome.fingerprint.as_deref(),
        token: tokens.map(|tokens| tokens.change.as_str()),
        token_for_looking: tokens.map(|tokens| tokens.look.as_str()),
    }
}

fn token_lines(tokens: &Tokens) -> String {
    format!(
        "token:             {}\ntoken for looking: {}\nThey are shown this once; --new-tokens makes new ones.",
        tokens.change, tokens.look
    )
}

fn text(welcome: &Welcome) -> String {
    let mut text = format!("{} serves {}", welcome.address, welcome.folder.display());
    if let Some(tokens) = &welcome.tokens {
        let qr = welcome.qr().unwrap_or_default();
        text += &format!("\n{}\n{qr}\n{}", token_lines(tokens), welcome.link());
    }
    if let Some(fingerprint) = &welcome.fingerprint {
        text += &format!("\nSHA-256 of the certificate: {fingerprint}");
    } else if welcome.asks_for_token {
        text += "\nNot encrypted: whoever listens on this network can read along.";
    }
    text + "\nCtrl-C ends the page; runs and evolutions go on."
}

/// Opens an address in the browser of the desktop; without one nothing happens.
fn open(address: &str) {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(windows) {
        "explorer"
    } else {
        "xdg-open"
    };
    let opened = Command::new(program).arg(address).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    if opened.is_err() {
        print_line(&format!("found no browser to open; the page is at {address}"));
    }
}
