//! What a core service has heard of the world: entities, zones, regions, geometry, missions.

use aldis_envelope::lmcp::cmasi::{
    AbstractZone, AutomationResponse, EntityConfiguration, EntityState, MissionCommand, OperatingRegion,
    RemoveEntities, RemoveZones,
};
use aldis_envelope::lmcp::impact::{AreaActionOptions, AreaOfInterest, LineOfInterest, PointOfInterest};
use aldis_envelope::lmcp::{Object, Struct, TypeInfo};
use std::collections::BTreeMap;

/// Everything by its id; the newest of each counts.
#[derive(Debug, Clone, Default)]
pub struct World {
    /// Configurations of entities, of whatever kind.
    pub configurations: BTreeMap<i64, Box<dyn Object>>,
    /// States of entities.
    pub states: BTreeMap<i64, Box<dyn Object>>,
    /// Zones to keep in, to keep out of, and of water.
    pub zones: BTreeMap<i64, Box<dyn Object>>,
    /// Operating regions.
    pub regions: BTreeMap<i64, OperatingRegion>,
    /// Areas of interest.
    pub areas: BTreeMap<i64, AreaOfInterest>,
    /// Lines of interest.
    pub lines: BTreeMap<i64, LineOfInterest>,
    /// Points of interest.
    pub points: BTreeMap<i64, PointOfInterest>,
    /// The mission of each vehicle.
    pub missions: BTreeMap<i64, MissionCommand>,
    /// Counts changes of configurations, zones and regions: what was computed from them is stale.
    pub version: u64,
}

impl World {
    /// The types that it takes.
    pub fn hears() -> Vec<&'static TypeInfo> {
        vec![
            EntityConfiguration::TYPE,
            EntityState::TYPE,
            AbstractZone::TYPE,
            OperatingRegion::TYPE,
            AreaOfInterest::TYPE,
            LineOfInterest::TYPE,
            PointOfInterest::TYPE,
            RemoveEntities::TYPE,
            RemoveZones::TYPE,
            MissionCommand::TYPE,
            AutomationResponse::TYPE,
        ]
    }

    /// Takes what it keeps; whether it was something of that.
    pub fn take(&mut self, object: &dyn Object) -> bool {
        if let Some(state) = object.get::<EntityState>() {
            self.states.insert(state.id, object.clone_box());
            return true;
        }
        self.take_fixed(object) || self.take_geometry(object) || self.take_missions(object)
    }

    fn take_fixed(&mut self, object: &dyn Object) -> bool {
        if let Some(entity) = object.get::<EntityConfiguration>() {
            let id = entity.id;
            let same = self.configurations.get(&id).is_some_and(|old| old.as_ref() == object);
            self.version += u64::from(!same);
            self.configurations.insert(id, object.clone_box());
        } else if let Some(zone) = object.get::<AbstractZone>() {
            self.zones.insert(zone.zone_id, object.clone_box());
            self.version += 1;
        } else if let Some(region) = object.get::<OperatingRegion>() {
            self.regions.insert(region.id, region.clone());
            self.version += 1;
        } else if let Some(gone) = object.get::<RemoveEntities>() {
            for id in &gone.entity_list {
                self.configurations.remove(id);
                self.states.remove(id);
                self.missions.remove(id);
            }
            self.version += 1;
        } else if let Some(gone) = object.get::<RemoveZones>() {
            gone.zone_list.iter().for_each(|id| drop(self.zones.remove(id)));
            self.version += 1;
        } else {
            return false;
        }
        true
    }

    fn take_geometry(&mut self, object: &dyn Object) -> bool {
        let is_gone = |action| action == AreaActionOptions::Destroyed;
        if let Some(area) = object.get::<AreaOfInterest>() {
            put(&mut self.areas, area.area_id, area, is_gone(area.area_action));
        } else if let Some(line) = object.get::<LineOfInterest>() {
            put(&mut self.lines, line.line_id, line, is_gone(line.line_action));
        } else if let Some(point) = object.get::<PointOfInterest>() {
            put(&mut self.points, point.point_id, point, is_gone(point.point_action));
        } else {
            return false;
        }
        true
    }

    fn take_missions(&mut self, object: &dyn Object) -> bool {
        if let Some(mission) = object.get::<MissionCommand>() {
            self.missions.insert(mission.vehicle_id, mission.clone());
        } else if let Some(response) = object.get::<AutomationResponse>() {
            let missions = response.mission_command_list.iter().filter_map(|mission| mission.get());
            self.missions.extend(missions.map(|mission| (mission.vehicle_id, mission.clone())));
        } else {
            return false;
        }
        true
    }

    /// The configuration of an entity.
    pub fn configuration(&self, id: i64) -> Option<&EntityConfiguration> {
        self.configurations.get(&id)?.get()
    }

    /// The state of an entity.
    pub fn state(&self, id: i64) -> Option<&EntityState> {
        self.states.get(&id)?.get()
    }

    /// The zones of a region: of region 0 none but water, which always holds for boats.
    pub fn zones_of(&self, region: i64) -> Vec<&dyn Object> {
        let Some(region) = self.regions.get(&region) else { return Vec::new() };
        let ids = region.keep_in_areas.iter().chain(&region.keep_out_areas);
        ids.filter_map(|id| self.zones.get(id)).map(|zone| zone.as_ref()).collect()
    }
}

fn put<T: Clone>(map: &mut BTreeMap<i64, T>, id: i64, object: &T, is_gone: bool) {
    match is_gone {
        true => drop(map.remove(&id)),
        false => drop(map.insert(id, object.clone())),
    }
}
