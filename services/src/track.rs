//! A vehicle that moves along a simple track and tells where it is: telemetry without a vehicle.

use crate::service::{Input, Level, Outbox, Service};
use aldis_envelope::lmcp::vehicles::SurfaceVehicleState;
use aldis_envelope::lmcp::{self, Ref, cmasi};
use aldis_envelope::{ContentType, EntityId, Instance, Label, Message, Monotonic, Name, Now, Source, Wall};
use std::sync::Arc;
use std::time::Duration;

/// The descriptor of the telemetry.
pub const DESCRIPTOR: &str = "afrl.vehicles.SurfaceVehicleState";

/// Metres of a degree of latitude on a sphere of 6371 km: good to half a percent, which a made-up track is not.
const METRES_PER_DEGREE: f64 = 111_195.0;

/// How a vehicle moves.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackConfig {
    /// The vehicle.
    pub entity: EntityId,
    /// Where it starts, degrees north.
    pub latitude_deg: f64,
    /// Where it starts, degrees east.
    pub longitude_deg: f64,
    /// Where it heads at first, degrees from north, clockwise.
    pub heading_deg: f64,
    /// How fast it is, in metres per second.
    pub speed_m_per_s: f64,
    /// How fast it turns, in degrees per second, clockwise.
    pub turn_rate_deg_per_s: f64,
    /// How often it tells, per second.
    pub rate_hz: f64,
}

/// The service that moves the vehicle.
pub struct Track {
    config: TrackConfig,
    label: Option<Arc<Label>>,
    period: Duration,
    latitude_deg: f64,
    longitude_deg: f64,
    heading_deg: f64,
    last: Option<Monotonic>,
    next: Option<Monotonic>,
}

impl Track {
    /// A track's service with these ids.
    pub fn new(source: Source, config: TrackConfig) -> Self {
        let label = Name::new(DESCRIPTOR).ok();
        let label = label.map(|name| Arc::new(Label::broadcast(ContentType::Lmcp, name, source)));
        let period = Duration::try_from_secs_f64(1.0 / config.rate_hz).unwrap_or(Duration::from_secs(1));
        let TrackConfig { latitude_deg, longitude_deg, heading_deg, .. } = config;
        Self { config, label, period, latitude_deg, longitude_deg, heading_deg, last: None, next: None }
    }

    fn advance(&mut self, now: Now) {
        let elapsed = self.last.map_or(0.0, |last| (now.monotonic - last).as_secs_f64());
        self.last = Some(now.monotonic);
        self.heading_deg = (self.heading_deg + self.config.turn_rate_deg_per_s * elapsed).rem_euclid(360.0);
        let metres = self.config.speed_m_per_s * elapsed;
        let (east, north) = self.heading_deg.to_radians().sin_cos();
        self.latitude_deg = (self.latitude_deg + metres * north / METRES_PER_DEGREE).clamp(-89.0, 89.0);
        let narrowing = self.latitude_deg.to_radians().cos();
        let longitude = self.longitude_deg + metres * east / (METRES_PER_DEGREE * narrowing);
        self.longitude_deg = (longitude + 180.0).rem_euclid(360.0) - 180.0;
    }

    fn state(&self, now: Now) -> SurfaceVehicleState {
        let speed = self.config.speed_m_per_s as f32;
        let mut state = SurfaceVehicleState { speed, ..Default::default() };
        state.id = i64::try_from(self.config.entity.get()).unwrap_or(i64::MAX);
        state.u = speed;
        state.groundspeed = speed;
        state.heading = self.heading_deg as f32;
        state.course = self.heading_deg as f32;
        state.r = self.config.turn_rate_deg_per_s as f32;
        state.time = now.wall.0.div_euclid(1_000_000);
        state.location = Ref::new(cmasi::Location3D {
            latitude: self.latitude_deg,
            longitude: self.longitude_deg,
            ..Default::default()
        });
        state
    }

    fn tell(&mut self, now: Now, out: &mut Outbox) {
        self.advance(now);
        self.next = Some(now.monotonic + self.period);
        let state = self.state(now);
        match (lmcp::encode(&state), &self.label) {
            (Ok(content), Some(label)) => {
                let message = Message::new(label.clone(), content.into());
                out.send(message.of_instance(Instance::of_number(state.id)));
            }
            (Err(why), _) => out.note(Level::Error, format!("the state cannot be written: {why}")),
            (_, None) => {}
        }
    }
}

/// How many bytes a state of such a track has.
pub fn state_bytes(source: Source, config: &TrackConfig) -> usize {
    let now = Now { monotonic: Monotonic::START, wall: Wall(0) };
    lmcp::encode(&Track::new(source, config.clone()).state(now)).map_or(0, |content| content.len())
}

impl Service for Track {
    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started | Input::Deadline => self.tell(now, out),
            Input::Message(envelope) if envelope.message.call.is_some() => {
                let what = envelope.message.label.descriptor().to_owned();
                out.refuse(envelope, aldis_envelope::Refusal::NotUnderstood(what));
            }
            Input::Shutdown => self.next = None,
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::ServiceId;

    #[test]
    fn a_vehicle_that_turns_all_the_way_comes_back() {
        let entity = EntityId::new(400).unwrap();
        let config = TrackConfig {
            entity,
            latitude_deg: 60.0,
            longitude_deg: 179.999,
            heading_deg: 0.0,
            speed_m_per_s: 5.0,
            turn_rate_deg_per_s: 3.6,
            rate_hz: 10.0,
        };
        let mut track = Track::new(Source::new(entity, ServiceId::new(100).unwrap()), config);
        let mut crossed = false;
        for tenth in 0..=1000 {
            let monotonic = Monotonic::since_start(Duration::from_millis(tenth * 100));
            track.advance(Now { monotonic, wall: Wall(0) });
            crossed |= track.longitude_deg < 0.0;
        }
        assert!(crossed, "the circle of 80 m radius reaches over the antimeridian");
        assert!((track.latitude_deg - 60.0).abs() < 1e-4 && (track.longitude_deg - 179.999).abs() < 1e-3);
    }
}
