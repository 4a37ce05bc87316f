//! OperatingRegionState: keeps operating region 0, which is all zones that were seen.
//!
//! | what comes | what it does |
//! | --- | --- |
//! | a zone that is new or has changed | with `additional_padding_m`, tells it again with so much more padding; tells region 0 |
//! | a zone that starts and ends at -1 | takes it out of region 0 |
//! | `RemoveZones` | takes them out of region 0 |
//!
//! Its own telling never comes back to it: a service does not get its own messages. Configuration:
//! `additional_padding_m` (0).

use super::machine::{Heard, Machine, Post};
use aldis_envelope::lmcp::cmasi::{AbstractZone, KeepInZone, KeepOutZone, OperatingRegion, RemoveZones};
use aldis_envelope::lmcp::{Object, Struct, TypeInfo};
use std::collections::{BTreeMap, BTreeSet};

/// Padding below this, in metres, is none.
const PADDING_MIN_M: f32 = 1e-4;

/// The machine.
pub struct RegionState {
    additional_padding_m: f32,
    keep_in: BTreeSet<i64>,
    keep_out: BTreeSet<i64>,
    /// What has been told with more padding: told again by another, it is no news.
    told: BTreeMap<i64, Box<dyn Object>>,
}

impl RegionState {
    /// A region without zones.
    pub fn new(additional_padding_m: f32) -> Self {
        Self {
            additional_padding_m,
            keep_in: BTreeSet::new(),
            keep_out: BTreeSet::new(),
            told: BTreeMap::new(),
        }
    }

    fn zone(&mut self, object: &dyn Object, zone: &AbstractZone, post: &mut Post<'_>) {
        let id = zone.zone_id;
        if self.told.get(&id).is_some_and(|told| told.as_ref() == object) {
            return;
        }
        if zone.start_time == -1 && zone.end_time == -1 {
            return self.remove(&[id], post);
        }
        let mut told = object.clone_box();
        if self.additional_padding_m > PADDING_MIN_M
            && let Some(padded) = told.get_mut::<AbstractZone>()
        {
            padded.padding += self.additional_padding_m;
            post.broadcast(told.as_ref());
        }
        self.told.insert(id, told);
        let (own, other) = match object.get::<KeepInZone>() {
            Some(_) => (&mut self.keep_in, &mut self.keep_out),
            None => (&mut self.keep_out, &mut self.keep_in),
        };
        other.remove(&id);
        own.insert(id);
        self.tell(post);
    }

    fn remove(&mut self, ids: &[i64], post: &mut Post<'_>) {
        let mut is_changed = false;
        for id in ids {
            self.told.remove(id);
            is_changed |= self.keep_in.remove(id) | self.keep_out.remove(id);
        }
        if is_changed {
            self.tell(post);
        }
    }

    fn tell(&self, post: &mut Post<'_>) {
        let keep_in_areas = self.keep_in.iter().copied().collect();
        let keep_out_areas = self.keep_out.iter().copied().collect();
        post.broadcast(&OperatingRegion { id: 0, keep_in_areas, keep_out_areas });
    }
}

impl Machine for RegionState {
    fn hears(&self) -> Vec<&'static TypeInfo> {
        vec![KeepInZone::TYPE, KeepOutZone::TYPE, RemoveZones::TYPE]
    }

    fn take(&mut self, heard: &Heard<'_>, post: &mut Post<'_>) {
        if let Some(gone) = heard.object.get::<RemoveZones>() {
            self.remove(&gone.zone_list, post);
        } else if let Some(zone) = heard.object.get::<AbstractZone>() {
            self.zone(heard.object, zone, post);
        }
    }
}
