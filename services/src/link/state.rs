//! States on their way out: the newest sample of every instance, sent again until it or a newer one arrived.

use super::frame::DIFFER_BYTES;
use super::names::InstanceEntry;
use super::wire::put_varint;
use aldis_envelope::{Change, Monotonic};
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Times in short form count in units of 1/16 s.
pub(super) const SHORT_TIME_US: i64 = 62_500;

/// A sample goes in short form only when it is older than this, so that the unit is at most 0.4 % of its age.
const SHORT_AGE: Duration = Duration::from_secs(16);

/// Numbers in short form are told modulo this.
pub(super) const SHORT_NUMBERS: u64 = 128;

/// How many samples may be on the air for the last of them to go twice: about a frame of the shortest. More, and the bytes are worth
/// more than the time.
const AGAIN_MAX: usize = 12;

/// Times in short form are told modulo so many units: 1 024 s.
pub(super) const SHORT_TIMES: i64 = 1 << 14;

/// The newest sample of an instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Sample {
    pub(super) origin: u32,
    pub(super) sequence: u64,
    /// Microseconds of the source's clock.
    pub(super) time: i64,
    pub(super) change: Change,
    pub(super) content: Bytes,
    pub(super) expires: Option<Monotonic>,
    /// When it was offered here.
    pub(super) since: Monotonic,
}

/// What the receiver is known to hold of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Mark {
    origin: u32,
    sequence: u64,
    time: i64,
}

#[derive(Debug, Default)]
struct Instance {
    sample: Option<Sample>,
    held: Option<Mark>,
    on_air: Option<(u32, u64)>,
    /// When the sample on the air went out; none where a second copy of it has gone after it.
    single_since: Option<Monotonic>,
    not_before: Monotonic,
    interval: Duration,
    /// The rule that lets it cross, and the part of the bytes that all under that rule may take, in per cent.
    share: (u32, u8),
}

/// The states of one direction.
#[derive(Debug, Default)]
pub(super) struct States {
    instances: BTreeMap<u32, Instance>,
    /// Those with a sample that is to go out.
    due: BTreeSet<u32>,
    /// Those whose sample waits for its interval.
    later: BTreeSet<(Monotonic, u32)>,
    /// Those whose names the peer does not have yet.
    nameless: BTreeSet<u32>,
    /// Where the round has come to.
    cursor: u32,
    on_air: usize,
    /// When those under a rule with a share may go again.
    rules: BTreeMap<u32, Monotonic>,
}

impl States {
    /// A new sample; an older one that was not sent is replaced. False where it is older than what is there.
    pub(super) fn offer(
        &mut self,
        number: u32,
        sample: Sample,
        (interval, share): (Duration, (u32, u8)),
        named: bool,
    ) -> bool {
        let instance = self.instances.entry(number).or_default();
        let older = |held: (u32, u64)| held.0 == sample.origin && held.1 >= sample.sequence;
        if instance.sample.as_ref().is_some_and(|held| older((held.origin, held.sequence))) {
            return false;
        }
        (instance.interval, instance.share) = (interval, share);
        let (not_before, since) = (instance.not_before, sample.since);
        instance.sample = Some(sample);
        if !named {
            self.nameless.insert(number);
        } else if not_before > since {
            self.later.insert((not_before, number));
        } else {
            self.due.insert(number);
        }
        true
    }

    /// Samples of other instances of a stream that wait are superseded. How many.
    pub(super) fn supersede(&mut self, number: u32, is_of_stream: impl Fn(u32) -> bool) -> u64 {
        let waiting = self.due.iter().chain(&self.nameless).copied();
        let waiting = waiting.chain(self.later.iter().map(|(_, number)| *number));
        let others: Vec<_> = waiting.filter(|other| *other != number && is_of_stream(*other)).collect();
        for other in &others {
            self.due.remove(other);
            self.nameless.remove(other);
            if let Some(instance) = self.instances.get_mut(other) {
                self.later.remove(&(instance.not_before, *other));
                // What the peer holds of it stays; a digest must not ask for what nobody wants.
                instance.sample = None;
            }
        }
        others.len() as u64
    }

    /// The peer has got names: what waited for them may go.
    pub(super) fn name(&mut self, is_named: impl Fn(u32, &Sample) -> bool) {
        let instances = &self.instances;
        let ready = |number: &u32| {
            instances.get(number).and_then(|i| i.sample.as_ref()).is_some_and(|s| is_named(*number, s))
        };
        let named: Vec<_> = self.nameless.iter().copied().filter(ready).collect();
        for number in named {
            self.nameless.remove(&number);
            self.due.insert(number);
        }
    }

    /// Lets those go whose interval is over, and drops those that nobody wants any more.
    pub(super) fn tick(&mut self, now: Monotonic) {
        while let Some(&(at, number)) = self.later.first().filter(|(at, _)| *at <= now) {
            self.later.remove(&(at, number));
            self.due.insert(number);
        }
    }

    pub(super) fn deadline(&self) -> Option<Monotonic> {
        self.later.first().map(|(at, _)| *at)
    }

    pub(super) fn is_due(&self) -> bool {
        !self.due.is_empty()
    }

    /// Whether nothing is to go out and nothing is on the air.
    pub(super) fn is_settled(&self) -> bool {
        self.due.is_empty() && self.on_air == 0 && self.later.is_empty() && self.nameless.is_empty()
    }

    /// Whether a sample of the instance waits.
    pub(super) fn is_waiting(&self, number: u32) -> bool {
        let instance = self.instances.get(&number);
        let later = instance.is_some_and(|instance| self.later.contains(&(instance.not_before, number)));
        self.due.contains(&number) || self.nameless.contains(&number) || later
    }

    /// How many instances wait with a sample.
    pub(super) fn waiting(&self) -> usize {
        self.due.len() + self.later.len() + self.nameless.len()
    }

    /// The next instance of the round after `after`, with its sample.
    pub(super) fn next(&mut self, now: Monotonic) -> Option<(u32, Sample)> {
        loop {
            let number = *self.due.range(self.cursor..).next().or_else(|| self.due.first())?;
            if self.put_off(now, number) {
                continue;
            }
            let sample = self.instances.get(&number).and_then(|instance| instance.sample.clone());
            match sample {
                Some(sample) if sample.expires.is_none_or(|expires| expires > now) => {
                    return Some((number, sample));
                }
                _ => {
                    self.due.remove(&number);
                }
            }
        }
    }

    /// Where the rule of an instance has had its share for now, the instance waits until the rule's turn.
    fn put_off(&mut self, now: Monotonic, number: u32) -> bool {
        let Some(instance) = self.instances.get_mut(&number) else { return false };
        let until = self.rules.get(&instance.share.0).copied().filter(|until| *until > now);
        if let Some(until) = until {
            self.due.remove(&number);
            instance.not_before = until;
            self.later.insert((until, number));
        }
        until.is_some()
    }

    /// The instance's sample went out, and took the carrier for so long.
    pub(super) fn sent(&mut self, number: u32, now: Monotonic, airtime: Duration) {
        self.due.remove(&number);
        self.cursor = number.wrapping_add(1);
        let Some(instance) = self.instances.get_mut(&number) else { return };
        let (rule, share) = instance.share;
        if share < 100 {
            let until = self.rules.get(&rule).copied().unwrap_or(now).max(now);
            self.rules.insert(rule, until + airtime * 100 / u32::from(share.max(1)));
        }
        instance.not_before = now + instance.interval;
        if instance.on_air.is_none() {
            self.on_air += 1;
        }
        let on_air = instance.sample.as_ref().map(|sample| (sample.origin, sample.sequence));
        instance.single_since = (instance.on_air != on_air).then_some(now);
        instance.on_air = on_air;
    }

    /// When the oldest of those samples went out that are on the air in one copy, where they are few.
    pub(super) fn lonely_since(&self) -> Option<Monotonic> {
        if self.on_air > AGAIN_MAX {
            return None;
        }
        let on_air = self.instances.values().filter(|instance| instance.on_air.is_some());
        on_air.filter_map(|instance| instance.single_since).min()
    }

    /// Nothing else is to go out: what went out once before `since`, and of which no word came, goes again.
    pub(super) fn again(&mut self, since: Monotonic) {
        for (&number, instance) in &mut self.instances {
            let lonely = instance.single_since.is_some_and(|at| at <= since);
            if lonely && instance.on_air.is_some() {
                instance.single_since = None;
                self.due.insert(number);
            }
        }
    }

    /// A sample arrived.
    pub(super) fn arrived(&mut self, number: u32, origin: u32, sequence: u64) {
        let Some(instance) = self.instances.get_mut(&number) else { return };
        if instance.on_air == Some((origin, sequence)) {
            instance.on_air = None;
            self.on_air -= 1;
        }
        let Some(sample) = &instance.sample else { return };
        if (sample.origin, sample.sequence) == (origin, sequence) {
            instance.held = Some(Mark { origin, sequence, time: sample.time });
            self.due.remove(&number);
        } else if let Some(held) = instance.held.filter(|held| held.origin == origin) {
            // An older sample than the newest arrived. Its time is not kept: the mark moves only in its number.
            instance.held = Some(Mark { sequence: held.sequence.max(sequence), ..held });
        }
    }

    /// A sample was lost: the newest goes, unless that has gone already.
    pub(super) fn lost(&mut self, number: u32, origin: u32, sequence: u64) {
        let Some(instance) = self.instances.get_mut(&number) else { return };
        if instance.on_air == Some((origin, sequence)) {
            instance.on_air = None;
            self.on_air -= 1;
            let held = instance.held.map(|held| (held.origin, held.sequence));
            if held != Some((origin, sequence)) {
                self.due.insert(number);
            }
        }
    }

    /// The peer may hold nothing any more: everything goes again.
    pub(super) fn doubt_all(&mut self) {
        for (&number, instance) in &mut self.instances {
            (instance.held, instance.on_air) = (None, None);
            if instance.sample.is_some() && !self.nameless.contains(&number) {
                self.due.insert(number);
            }
        }
        self.on_air = 0;
    }

    /// The short form of a sample, if it has one, after instance `before` in the same frame: the receiver knows the rest.
    pub(super) fn short(
        &self,
        number: u32,
        entry: &InstanceEntry,
        before: Option<u32>,
        now: Monotonic,
    ) -> Option<Vec<u8>> {
        let instance = self.instances.get(&number)?;
        let (sample, held) = (instance.sample.as_ref()?, instance.held?);
        let plain = sample.change == Change::Put
            && sample.expires.is_none()
            && sample.origin == held.origin
            && sample.content.len() == entry.usual as usize
            && now - sample.since >= SHORT_AGE;
        let numbers = sample.sequence.checked_sub(held.sequence).filter(|n| *n < SHORT_NUMBERS);
        let units = sample.time.div_euclid(SHORT_TIME_US);
        let passed = units.checked_sub(held.time.div_euclid(SHORT_TIME_US));
        if !plain || numbers.is_none() || !passed.is_some_and(|passed| (0..SHORT_TIMES).contains(&passed)) {
            return None;
        }
        let mut out = Vec::with_capacity(3 + sample.content.len());
        match before {
            None => {
                put_varint(number.into(), &mut out);
                out.push(1 << 5);
            }
            Some(before) => {
                let mut step = number.checked_sub(before)?;
                while step > 7 {
                    let sevens = ((step - 1) / 7).min(32);
                    out.push(sevens as u8 - 1);
                    step -= sevens * 7;
                }
                out.push((step as u8) << 5);
            }
        }
        if let Some(last) = out.last_mut() {
            *last |= (sample.sequence % 32) as u8;
        }
        let high = (sample.sequence / 32 % 4) as u16;
        let time = units.rem_euclid(SHORT_TIMES) as u16;
        out.extend_from_slice(&(high << 14 | time).to_be_bytes());
        out.extend_from_slice(&sample.content);
        Some(out)
    }

    /// How many instances the peer is believed to hold, and the digest of them in parts.
    pub(super) fn digest(&self) -> (u32, DigestParts) {
        let held = self.instances.iter().filter_map(|(&n, i)| Some((n, i.held?.sequence)));
        held.fold((0, DigestParts::default()), |(count, mut parts), (number, sequence)| {
            parts.add(number, sequence);
            (count + 1, parts)
        })
    }

    /// The peer holds something else: what is in parts that differ goes again.
    pub(super) fn doubt(&mut self, theirs: &[u8]) {
        let ours = self.digest().1.encode();
        for (&number, instance) in &mut self.instances {
            let part = DigestParts::part(number) * 2;
            if theirs.get(part..part + 2) != ours.get(part..part + 2) && instance.sample.is_some() {
                instance.held = None;
                self.due.insert(number);
            }
        }
    }
}

/// A digest of (instance, sequence) pairs in sixteen parts. The order of adding does not matter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct DigestParts([u64; 16]);

impl DigestParts {
    pub(super) fn add(&mut self, number: u32, sequence: u64) {
        // The finishing steps of SplitMix64: every bit of the input moves half of the output.
        let mut mixed = (u64::from(number) << 40 ^ sequence).wrapping_add(0x9e37_79b9_7f4a_7c15);
        mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        let part = &mut self.0[Self::part(number)];
        *part = part.wrapping_add(mixed ^ mixed >> 31);
    }

    /// Neighbours are in one part: what changes together is sent together.
    fn part(number: u32) -> usize {
        (number / 8 % 16) as usize
    }

    pub(super) fn whole(&self) -> u64 {
        self.0.iter().fold(0, |sum: u64, part| sum.rotate_left(7) ^ part)
    }

    pub(super) fn encode(&self) -> [u8; DIFFER_BYTES] {
        let mut out = [0; DIFFER_BYTES];
        for (two, part) in out.chunks_exact_mut(2).zip(self.0) {
            two.copy_from_slice(&((part >> 48) as u16).to_be_bytes());
        }
        out
    }
}

#[cfg(test)]
mod tests;
