//! Where the page is, or tev.

use std::fmt;
use std::io;
use std::net::{IpAddr, Ipv6Addr, SocketAddr, ToSocketAddrs};
use std::str::FromStr;

/// A host and a port, as text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// An IP address or a name, without brackets.
    pub host: String,
    /// The port; 0 for any free one.
    pub port: u16,
}

impl Address {
    /// The addresses that it names.
    pub fn resolve(&self) -> io::Result<Vec<SocketAddr>> {
        Ok((self.host.as_str(), self.port).to_socket_addrs()?.collect())
    }
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const RULE: &str =
            "expected an address and a port, such as 127.0.0.1:8080, [::1]:8080 or localhost:8080";
        let (host, port) = text.rsplit_once(':').ok_or(RULE)?;
        // Without this, "+80" would be a port.
        let digits = !port.is_empty() && port.bytes().all(|b| b.is_ascii_digit());
        let port = port.parse().ok().filter(|_| digits);
        let port = port.ok_or("the port must be a whole number from 0 to 65535")?;
        let host = match host.strip_prefix('[').map(|h| h.strip_suffix(']')) {
            Some(Some(inside)) if inside.parse::<Ipv6Addr>().is_ok() => inside,
            Some(_) => return Err(RULE.into()),
            // It might be the address ::1:80 itself.
            None if host.contains(':') => return Err(RULE.into()),
            None => host,
        };
        let is_name = |h: &str| {
            let letter = |b: u8| b.is_ascii_alphanumeric() || b"-._".contains(&b);
            !h.is_empty() && h.bytes().all(letter)
        };
        // A number that is no address, such as 127.0.0.256, would be looked up as a name.
        let is_number = |h: &str| h.bytes().all(|b| b.is_ascii_digit() || b == b'.');
        if host.parse::<IpAddr>().is_err() && (!is_name(host) || is_number(host)) {
            return Err(RULE.into());
        }
        let host = host.into();
        Ok(Self { host, port })
    }
}

/// As an address is written in a URL.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.host.contains(':') {
            write!(f, "[{}]:{}", self.host, self.port)
        } else {
            write!(f, "{}:{}", self.host, self.port)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_have_a_host_and_a_port() {
        for good in [
            "127.0.0.1:8080",
            "[::1]:0",
            "localhost:65535",
            "node-3.lab:80",
        ] {
            assert_eq!(good.parse::<Address>().unwrap().to_string(), good);
        }
        for bad in [
            "8080",
            ":8080",
            "localhost",
            "localhost:",
            "localhost:http",
            "127.0.0.1:65536",
            "127.0.0.1:+80",
            "127.0.0.256:80",
            "::1:80",
            "[::1:80",
            "[x]:80",
            "a b:80",
            "http://localhost:80",
            "",
        ] {
            assert!(bad.parse::<Address>().is_err(), "{bad}");
        }
    }
}
