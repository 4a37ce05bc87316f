//! From where something is looked at: the directions that wedges allow.

use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::Wedge;

/// How far apart directions are tried, in degrees.
const STEP_DEG: f64 = 22.5;

/// The elevation where no wedge names one, in degrees.
const ELEVATION_DEG: f64 = -60.0;

/// Elevations above this, in degrees, look up.
const LOOKS_UP_DEG: f64 = 10.0;

fn samples(middle_deg: f64, extent_deg: f64) -> impl Iterator<Item = f64> {
    let first = middle_deg - extent_deg.abs() / 2.0;
    let count = (extent_deg.abs() / STEP_DEG).floor() as u32;
    (0..=count.min(15)).map(move |at| first + f64::from(at) * STEP_DEG)
}

/// The azimuths of wedges, in degrees; `default` where there are no wedges.
pub(super) fn azimuths(wedges: &[Ref<Wedge>], default: &[f64]) -> Vec<f64> {
    let wedges: Vec<_> = wedges.iter().filter_map(|wedge| wedge.get()).collect();
    if wedges.is_empty() {
        return default.to_vec();
    }
    let of = |wedge: &Wedge| samples(f64::from(wedge.azimuth_centerline), f64::from(wedge.azimuth_extent));
    wedges.into_iter().flat_map(of).collect()
}

/// The elevations of wedges, in degrees, each once. A look up is taken for one down, as old task files measure it.
pub(super) fn elevations(wedges: &[Ref<Wedge>]) -> Vec<f64> {
    let mut found = Vec::new();
    for wedge in wedges.iter().filter_map(|wedge| wedge.get()) {
        let (middle, extent) = (f64::from(wedge.vertical_centerline), f64::from(wedge.vertical_extent));
        let middle = if middle > LOOKS_UP_DEG { -middle } else { middle };
        found.extend(samples(middle, extent).map(|elevation| elevation.clamp(-90.0, 10.0)));
    }
    if found.is_empty() {
        found.push(ELEVATION_DEG);
    }
    found.sort_by(f64::total_cmp);
    found.dedup();
    found
}

/// What is to be told of wedges that look up: the reference takes them for looks at the horizon without a word.
pub(super) fn doubts(wedges: &[Ref<Wedge>]) -> Vec<String> {
    let wedges = wedges.iter().filter_map(|wedge| wedge.get());
    let up = wedges.filter(|wedge| f64::from(wedge.vertical_centerline) > LOOKS_UP_DEG);
    let doubt = |wedge: &Wedge| {
        let up = wedge.vertical_centerline;
        format!(
            "a view angle has the elevation {up}°, which looks up: it is taken for {}°, negative is down",
            -up
        )
    };
    up.map(doubt).collect()
}

/// Sixteen directions around.
pub(super) fn around() -> Vec<f64> {
    (0..16).map(|at| f64::from(at) * STEP_DEG).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wedge(azimuth: f32, extent: f32, elevation: f32) -> Ref<Wedge> {
        Ref::new(Wedge {
            azimuth_centerline: azimuth,
            azimuth_extent: extent,
            vertical_centerline: elevation,
            vertical_extent: 0.0,
        })
    }

    #[test]
    fn a_wedge_is_sampled_from_its_start() {
        assert_eq!(azimuths(&[wedge(35.0, 0.0, -60.0)], &[45.0]), [35.0]);
        assert_eq!(azimuths(&[wedge(0.0, 50.0, -60.0)], &[45.0]), [-25.0, -2.5, 20.0]);
        assert_eq!(azimuths(&[], &[45.0]), [45.0]);
        assert_eq!(around().len(), 16);
    }

    #[test]
    fn a_look_up_is_one_down_with_a_word() {
        assert_eq!(elevations(&[wedge(0.0, 0.0, -60.0), wedge(9.0, 0.0, 60.0)]), [-60.0]);
        assert_eq!(elevations(&[]), [-60.0]);
        assert!(doubts(&[wedge(0.0, 0.0, 60.0)])[0].contains("taken for -60°"));
        assert!(doubts(&[wedge(0.0, 0.0, -60.0)]).is_empty());
    }
}
