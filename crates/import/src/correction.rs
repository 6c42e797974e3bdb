//! What physics would change in a mapping: proposed with a finding, applied by whoever agrees.

use serde::{Deserialize, Serialize};

use crate::by_name::ByName;
use crate::mapping::{Mapping, Mount, SignalSource};

/// Changes of a mapping that go together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Amendment {
    /// Where signals come from instead, by canonical name.
    #[serde(default, skip_serializing_if = "ByName::is_empty")]
    pub signals: ByName<SignalSource>,
    /// Signals that the log does not have.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remove: Vec<String>,
    /// How housings sit.
    #[serde(default, skip_serializing_if = "ByName::is_empty")]
    pub mounts: ByName<Mount>,
    /// How late channels are, s.
    #[serde(default, skip_serializing_if = "ByName::is_empty")]
    pub delays: ByName<f64>,
}

impl Amendment {
    /// One signal from another source.
    pub fn of(signal: &str, source: SignalSource) -> Self {
        let mut out = Self::default();
        out.signals.insert(signal.to_owned(), source);
        out
    }

    /// Whether it changes nothing at all.
    pub fn is_empty(&self) -> bool {
        self.signals.is_empty() && self.remove.is_empty() && self.mounts.is_empty() && self.delays.is_empty()
    }

    /// Whether a mapping already has what it would change, or says itself how the housing sits or how late it is.
    pub fn is_done(&self, mapping: &Mapping) -> bool {
        self.signals.iter().all(|(name, source)| mapping.signals.get(name) == Some(source))
            && !self.remove.iter().any(|name| mapping.signals.contains_key(name))
            && self.mounts.keys().all(|channel| mapping.mounts.contains_key(channel))
            && self.delays.keys().all(|channel| mapping.delays.contains_key(channel))
    }
}

impl Mapping {
    /// Take a correction over: its signals, mounts and delays replace those of the same name.
    ///
    /// ```
    /// use drivescope_import::{Amendment, Mapping, SignalSource};
    /// let text = r#"{"version": 1, "time": {"column": "t"}, "signals": {"gyro_z": {"column": "r"}}}"#;
    /// let mut mapping = Mapping::from_json(text, "m.json")?;
    /// let source = SignalSource { scale: -1.0, ..SignalSource::plain("r") };
    /// mapping.correct(&Amendment::of("gyro_z", source));
    /// assert_eq!(mapping.signals["gyro_z"].scale, -1.0);
    /// # Ok::<(), drivescope_import::ImportError>(())
    /// ```
    pub fn correct(&mut self, correction: &Amendment) {
        let Amendment { signals, remove, mounts, delays } = correction.clone();
        self.signals.retain(|name| !remove.iter().any(|r| r == name));
        self.signals.extend(signals);
        self.mounts.extend(mounts);
        self.delays.extend(delays);
    }
}
