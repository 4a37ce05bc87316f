//! Health: in 6.0 a resource has one instance a code, in 5.2.1 one altogether.

use super::convert::{guid_of, member, set};
use super::{Lost, REMEMBERED_MAX, Sample, Translator};
use aldis_envelope::codec::cdr::Value;
use aldis_envelope::{Change, Guid};

const TOPIC: &str = "UMAA::SO::HealthReport::HealthReport";
const TYPE: &str = "UMAA::SO::HealthReport::HealthReportType";

/// Source and resource.
type Resource = (Guid, Guid);

impl Translator {
    pub(super) fn health_to_older(&mut self, sample: &Sample) -> Result<Vec<Sample>, Lost> {
        let (resource, code) = self.resource(sample, true)?;
        let code = code.ok_or_else(|| due(&sample.topic, "code"))?;
        let value = self.converted(sample, TYPE, false)?;
        let older = Sample { topic: TOPIC.to_owned(), change: sample.change, value };
        if sample.change == Change::Put {
            self.codes_of(resource).insert(code);
            return Ok(vec![older]);
        }
        let left = self.codes.get_mut(&resource).is_some_and(|codes| {
            codes.remove(&code);
            !codes.is_empty()
        });
        if left {
            return Err(Lost::OneOfSeveralCodes { topic: sample.topic.clone() });
        }
        self.codes.remove(&resource);
        Ok(vec![older])
    }

    pub(super) fn health_to_newer(&mut self, sample: &Sample) -> Result<Vec<Sample>, Lost> {
        let (resource, code) = self.resource(sample, false)?;
        let value = self.converted(sample, TYPE, true)?;
        let newer = Sample { topic: TYPE.to_owned(), change: sample.change, value };
        if sample.change == Change::Put {
            let code = code.ok_or_else(|| due(&sample.topic, "code"))?;
            let before = std::mem::take(self.codes_of(resource));
            self.codes_of(resource).insert(code);
            // In 5.2.1 a new code replaces the one before; in 6.0 that would stay beside it.
            let ended = before.into_iter().filter(|other| *other != code);
            let ended = ended.map(|other| self.ended(&newer, other, Change::Dispose)).collect::<Vec<_>>();
            return Ok(ended.into_iter().chain([newer]).collect());
        }
        let codes = self.codes.remove(&resource).unwrap_or_default();
        if codes.is_empty() {
            return Err(Lost::UnknownCode { topic: sample.topic.clone() });
        }
        Ok(codes.into_iter().map(|code| self.ended(&newer, code, sample.change)).collect())
    }

    /// The end of the instance of a code, with the key members of another sample of its resource.
    fn ended(&self, sample: &Sample, code: i32, change: Change) -> Sample {
        let mut value = sample.value.clone();
        for name in ["logTime", "severity", "status", "timeStamp"] {
            set(&self.newer, TYPE, &mut value, name, None);
        }
        set(&self.newer, TYPE, &mut value, "code", Some(Value::Enumeration(code)));
        Sample { topic: TYPE.to_owned(), change, value }
    }

    fn codes_of(&mut self, resource: Resource) -> &mut std::collections::BTreeSet<i32> {
        if self.codes.len() >= REMEMBERED_MAX && !self.codes.contains_key(&resource) {
            self.codes.pop_first();
        }
        self.codes.entry(resource).or_default()
    }

    fn resource(&self, sample: &Sample, newer: bool) -> Result<(Resource, Option<i32>), Lost> {
        let library = if newer { &self.newer } else { &self.older };
        let of = |name| member(library, TYPE, &sample.value, name);
        let guid = |name| guid_of(of(name)).ok_or_else(|| due(&sample.topic, name));
        let code = match of("code") {
            Some(Value::Enumeration(code)) => Some(*code),
            _ => None,
        };
        Ok(((guid("source")?, guid("resourceID")?), code))
    }
}

pub(super) fn due(topic: &str, member: &str) -> Lost {
    Lost::Member { topic: topic.to_owned(), member: member.to_owned() }
}
