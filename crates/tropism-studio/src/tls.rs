//! Encryption with one's own certificate.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio::io::{AsyncRead, AsyncWrite};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_rustls::rustls::crypto::ring::default_provider;
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::server::TlsStream;
use tropism_lab::files;

use crate::error::StudioError;

/// The first byte of a handshake.
const HANDSHAKE: u8 = 0x16;

/// The name of HTTP/2 in a handshake (RFC 7301).
const HTTP2: &[u8] = b"h2";

/// The files of a certificate and its key, in PEM.
#[derive(Clone, Debug)]
pub struct TlsFiles {
    /// The certificate, and those between it and its root.
    pub certificate: PathBuf,
    /// Its private key, without a passphrase.
    pub key: PathBuf,
}

/// A certificate that pages are served with.
#[derive(Clone)]
pub(crate) struct Tls {
    acceptor: TlsAcceptor,
    /// SHA-256 of the certificate, as browsers show it.
    pub(crate) fingerprint: String,
}

impl Tls {
    /// # Errors
    /// [`StudioError`] names the file and says what was found in it.
    pub(crate) fn read(named: &TlsFiles) -> Result<Self, StudioError> {
        let TlsFiles { certificate, key } = named;
        let at = |path: &Path, problem: String| StudioError::Tls { path: path.to_owned(), problem };
        let text = files::read(certificate)?;
        let chain: Result<Vec<CertificateDer<'static>>, _> = CertificateDer::pem_slice_iter(&text).collect();
        let chain = chain.map_err(|error| at(certificate, format!("found no PEM ({error})")))?;
        let own = chain.first().ok_or_else(|| {
            let wanted = "it is PEM that begins with -----BEGIN CERTIFICATE-----";
            at(certificate, format!("no certificate here: {wanted}"))
        })?;
        let digest = files::sha256(own).to_uppercase();
        let pairs: Vec<&str> =
            digest.as_bytes().chunks(2).filter_map(|pair| str::from_utf8(pair).ok()).collect();
        let fingerprint = pairs.join(":");
        let config = ServerConfig::builder_with_provider(Arc::new(default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(|error| StudioError::System(format!("TLS: {error}")))?
            .with_no_client_auth()
            .with_single_cert(chain, read_key(key)?);
        let mut config = config.map_err(|error| {
            let wanted = "wanted the key of this certificate";
            at(key, format!("does not go with {}: {error}; {wanted}", certificate.display()))
        })?;
        config.alpn_protocols = vec![HTTP2.to_vec(), b"http/1.1".to_vec()];
        Ok(Self { acceptor: TlsAcceptor::from(Arc::new(config)), fingerprint })
    }

    /// Shakes hands.
    pub(crate) async fn accept<S: AsyncRead + AsyncWrite + Unpin>(
        &self,
        stream: S,
    ) -> std::io::Result<TlsStream<S>> {
        self.acceptor.accept(stream).await
    }
}

/// Whether both sides of `stream` speak HTTP/2.
pub(crate) fn is_http2<S>(stream: &TlsStream<S>) -> bool {
    stream.get_ref().1.alpn_protocol() == Some(HTTP2)
}

/// Whether `first`, the first byte of a connection, begins a handshake.
pub(crate) const fn is_handshake(first: u8) -> bool {
    first == HANDSHAKE
}

fn read_key(path: &Path) -> Result<PrivateKeyDer<'static>, StudioError> {
    let problem = |problem: &str| StudioError::Tls { path: path.to_owned(), problem: problem.to_owned() };
    let text = files::read(path)?;
    check_kept(path).map_err(|found| problem(&found))?;
    let is_encrypted = String::from_utf8_lossy(&text).contains("ENCRYPTED");
    PrivateKeyDer::from_pem_slice(&text).map_err(|_| {
        if is_encrypted {
            problem("the key has a passphrase: `openssl pkey -in KEY -out PLAIN-KEY` makes one without")
        } else {
            problem("no private key here: it is PEM that begins with -----BEGIN PRIVATE KEY-----")
        }
    })
}

/// Refuses a key that everybody on this computer can read; a group of the system may.
#[cfg(unix)]
fn check_kept(path: &Path) -> Result<(), String> {
    use std::os::unix::fs::PermissionsExt;

    let mode = path.metadata().map_err(|error| error.to_string())?.permissions().mode() & 0o777;
    if mode & 0o007 == 0 {
        return Ok(());
    }
    Err(format!(
        "found mode {mode:o}, with which everybody on this computer reads the key; wanted 600: `chmod 600` it"
    ))
}

#[cfg(not(unix))]
fn check_kept(_path: &Path) -> Result<(), String> {
    Ok(())
}
