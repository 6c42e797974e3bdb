//! What a person can choose for a column: signals with the units that they are read in.

use serde::Serialize;

use super::survey::canonical_unit;
use crate::channels::CHANNELS;
use crate::units;

/// A signal that a raw column can be read as.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// Canonical name.
    pub signal: &'static str,
    /// Its channel.
    pub channel: &'static str,
    /// Unit of the raw values where a mapping names none.
    pub unit: &'static str,
    /// One spelling of each unit that is understood, with commas between them.
    pub units: String,
    /// One sentence.
    pub doc: &'static str,
}

/// Every measured signal, by channel.
pub fn choices() -> Vec<Choice> {
    let all = CHANNELS.iter().flat_map(|&(channel, columns)| columns.iter().map(move |c| (channel, c)));
    all.map(|(channel, c)| Choice {
        signal: c.name,
        channel,
        unit: canonical_unit(c.name),
        units: units::spellings(c.unit),
        doc: c.doc,
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches a unit that is offered and refused once it is chosen, and a signal without any.
    #[test]
    fn every_unit_that_is_offered_is_understood() {
        for choice in choices() {
            let si = crate::signal(choice.signal).unwrap().unit;
            for unit in choice.units.split(", ").chain([choice.unit]) {
                assert!(units::factor(unit, si).is_some(), "{}: `{unit}`", choice.signal);
            }
        }
    }
}
