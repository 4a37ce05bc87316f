//! Rounds of load and round trips, several sides turn about.

use super::super::exit::Failure;
use super::load::{Frames, Pair};
use super::statistics::percentile;

/// How much is measured.
pub(super) struct Rounds {
    pub(super) rounds: u32,
    pub(super) messages: u64,
    pub(super) round_trips: u64,
}

/// What one side did, round by round.
#[derive(Debug, Default)]
pub(super) struct Figures {
    /// Messages a second.
    pub(super) rates: Vec<f64>,
    /// Round trips in microseconds.
    pub(super) p50: Vec<f64>,
    pub(super) p99: Vec<f64>,
    /// Messages that never came.
    pub(super) lost: u64,
}

impl Rounds {
    /// Measures the sides turn about.
    pub(super) fn measure<const N: usize>(
        &self,
        mut sides: [&mut Pair; N],
        frames: &Frames,
    ) -> Result<[Figures; N], Failure> {
        let mut figures = std::array::from_fn(|_| Figures::default());
        for round in 0..=self.rounds {
            for (side, figures) in sides.iter_mut().zip(&mut figures) {
                self.round(side, frames, round > 0, figures)?;
            }
        }
        Ok(figures)
    }

    fn round(
        &self,
        side: &mut Pair,
        frames: &Frames,
        counts: bool,
        figures: &mut Figures,
    ) -> Result<(), Failure> {
        // The first round warms up and does not count.
        let (messages, trips) = if counts {
            (self.messages, self.round_trips)
        } else {
            (self.messages / 10, self.round_trips / 10)
        };
        let (took, seen) = side.load(frames, messages)?;
        let mut trips = side.round_trips(frames, trips)?;
        figures.lost += messages.saturating_sub(seen);
        if counts {
            figures.rates.push(messages as f64 / took.as_secs_f64());
            figures.p50.push(percentile(&mut trips, 0.50).as_secs_f64() * 1e6);
            figures.p99.push(percentile(&mut trips, 0.99).as_secs_f64() * 1e6);
        }
        Ok(())
    }
}
