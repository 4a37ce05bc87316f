//! `aldis link plan`: what a load costs on a link, before anything is sent.

use crate::cli::exit::Failure;
use crate::cli::print_line;
use crate::config::{Config, Service};
use aldis_envelope::umaa::{HealthReport, Topic};
use aldis_envelope::{ContentType, Label, Name, ServiceId, Source};
use aldis_services::link::LinkSpec;
use aldis_services::link::plan::{Flow, Plan as Planned, plan};
use aldis_services::sim::link::cost;
use aldis_services::track;
use serde_json::json;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

/// The bytes of a health report without a text.
const HEALTH_BYTES: usize = 90;
/// Services that every node has, each with a health report.
const BUILT_IN: u32 = 3;

/// What the messages of a configuration cost on its links: bytes a second by class and descriptor, what starves, how long the worst
/// command takes, how soon all is whole again after an outage.
///
/// What the configuration itself makes is taken from it: tracks and health reports. What else crosses is told by `--flow`.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  aldis link plan configs/vehicle-400.toml
  aldis link plan configs/link/shore.toml --check
  aldis link plan configs/shore.toml --flow UMAA::MM::X::XCommand:64:0.5 --flow UMAA::SA::Y::YReport:48:10:10")]
pub(super) struct Plan {
    /// The configuration.
    config: PathBuf,
    /// A kind of message: DESCRIPTOR:BYTES:PER_SECOND, and :INSTANCES where it has more than one.
    #[arg(long = "flow")]
    flows: Vec<Load>,
    /// A kind of message that comes from the other end, in the same form: it costs acknowledgements here.
    #[arg(long = "back")]
    back: Vec<Load>,
    /// Runs the load over a simulated link with the figures of the first carrier, and tells how far the plan is from what it costs.
    #[arg(long)]
    check: bool,
    /// With `--check`: virtual seconds of the run.
    #[arg(long, default_value_t = 3_600, requires = "check", value_parser = clap::value_parser!(u64).range(60..=864_000))]
    seconds: u64,
    /// With `--check`: draws the losses.
    #[arg(long, default_value_t = 1, requires = "check")]
    seed: u64,
    /// One JSON object a link.
    #[arg(long)]
    json: bool,
}

/// A kind of message.
#[derive(Debug, Clone, PartialEq)]
struct Load {
    descriptor: String,
    bytes: usize,
    per_second: f64,
    instances: u32,
}

impl FromStr for Load {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("`{text}`: write DESCRIPTOR:BYTES:PER_SECOND or DESCRIPTOR:BYTES:PER_SECOND:INSTANCES")
        };
        let parts: Vec<_> = text.rsplitn(4, ':').collect();
        let number =
            |part: &str| part.parse::<f64>().ok().filter(|number| number.is_finite() && *number >= 0.0);
        // Descriptors may have colons of their own: with three numbers at the end the last is how many instances.
        let (numbers, descriptor) = match parts.as_slice() {
            [i, p, b, d] if [i, p, b].iter().all(|part| number(part).is_some()) => {
                ([*b, *p, *i], (*d).to_owned())
            }
            [p, b, ..] => {
                let descriptor = text.strip_suffix(&format!(":{b}:{p}")).ok_or_else(wrong)?;
                ([*b, *p, "1"], descriptor.to_owned())
            }
            _ => return Err(wrong()),
        };
        let [Some(bytes), Some(per_second), Some(instances)] = numbers.map(number) else {
            return Err(wrong());
        };
        if instances < 1.0 || bytes > 16e6 {
            return Err(wrong());
        }
        Ok(Self { descriptor, bytes: bytes as usize, per_second, instances: instances as u32 })
    }
}

/// What the node of a configuration makes by itself.
fn own_loads(config: &Config) -> Vec<Load> {
    let own = config.entities.own();
    let tracks = config.services.iter().filter_map(|service| {
        let Service::Track(configured) = service else { return None };
        let motion = configured.motion(own);
        let bytes = track::state_bytes(configured.source(own), &motion);
        Some(Load { descriptor: track::DESCRIPTOR.into(), bytes, per_second: motion.rate_hz, instances: 1 })
    });
    let parts = BUILT_IN + config.services.len() as u32 + config.bridges.len() as u32;
    let per_second = f64::from(parts) / config.health.report_period().as_secs_f64();
    let health =
        Load { descriptor: HealthReport::NAME.into(), bytes: HEALTH_BYTES, per_second, instances: parts };
    tracks.chain([health]).collect()
}

/// How a kind of message crosses a link, if at all; a rule's rate is the most that goes out of each instance.
fn flow(spec: &LinkSpec, config: &Config, load: &Load) -> Option<Flow> {
    let name = Name::new(&load.descriptor).ok()?;
    let source = Source::new(config.entities.own(), ServiceId::NODE);
    let label = Label::broadcast(ContentType::Umaa, name, source);
    let rule = &spec.export.rules[spec.export.rule_of(&label).ok()?];
    let most = match rule.interval.as_secs_f64() {
        interval if interval > 0.0 => f64::from(load.instances) / interval,
        _ => f64::INFINITY,
    };
    Some(Flow {
        descriptor: load.descriptor.clone(),
        class: rule.class,
        bytes: load.bytes,
        per_second: load.per_second.min(most),
        instances: load.instances,
    })
}

/// What of a configuration's own messages starves on its links, in words.
pub(in crate::cli) fn starving(config: &Config) -> Vec<String> {
    let plans = planned(config, &own_loads(config), &[]);
    let of = |(spec, planned): (LinkSpec, Planned)| {
        let starving = planned.flows.into_iter().filter(|flow| flow.starves);
        let words = starving.map(move |flow| {
            format!(
                "link {}: {} wants {:.0} bytes a second and gets {:.0}; a `rate_hz` in its rule says how much is enough",
                spec.name, flow.descriptor, flow.wanted, flow.granted
            )
        });
        words.collect::<Vec<_>>()
    };
    plans.into_iter().flat_map(of).collect()
}

/// What crosses a link of the load, and of what comes back.
fn flows(spec: &LinkSpec, config: &Config, loads: &[Load]) -> Vec<Flow> {
    loads.iter().filter_map(|load| flow(spec, config, load)).collect()
}

fn planned(config: &Config, loads: &[Load], back: &[Load]) -> Vec<(LinkSpec, Planned)> {
    let one = |link: &crate::config::Link| {
        let spec = link.spec(config.entities.own());
        let (flows, back) = (flows(&spec, config, loads), flows(&spec, config, back));
        let keyed = !link.keys.is_empty();
        let planned = spec.link.carriers.first().map(|carrier| plan(carrier, keyed, &flows, &back));
        planned.map(|planned| (spec, planned))
    };
    config.links.iter().filter_map(one).collect()
}

impl Plan {
    pub(super) fn run(self) -> Result<(), Failure> {
        let config = Config::load(&self.config)?;
        let loads: Vec<_> = own_loads(&config).into_iter().chain(self.flows.iter().cloned()).collect();
        let plans = planned(&config, &loads, &self.back);
        if plans.is_empty() {
            return Err(Failure::Usage(format!("{} has no links", self.config.display())));
        }
        for (spec, planned) in &plans {
            let stays = loads.iter().filter(|load| flow(spec, &config, load).is_none());
            let stays: Vec<_> = stays.map(|load| load.descriptor.as_str()).collect();
            let checked = if self.check { self.measure(spec, &config, &loads, planned) } else { None };
            if self.json {
                print_line(object(spec, planned, &stays, checked));
            } else {
                print(spec, planned, &stays, checked);
            }
        }
        Ok(())
    }

    /// What the load costs in a run. None for a link without a carrier.
    fn measure(
        &self,
        spec: &LinkSpec,
        config: &Config,
        loads: &[Load],
        planned: &Planned,
    ) -> Option<Checked> {
        let (there, back) = (flows(spec, config, loads), flows(spec, config, &self.back));
        let (carrier, keyed) = (spec.link.carriers.first()?, !spec.link.keys.is_empty());
        let measured = cost(carrier, keyed, (&there, &back), Duration::from_secs(self.seconds), self.seed);
        Some(Checked { planned: planned.bytes_per_second(), measured })
    }
}

/// Bytes a second by the plan and in a run.
#[derive(Debug, Clone, Copy)]
struct Checked {
    planned: f64,
    measured: f64,
}

impl Checked {
    fn off_percent(self) -> f64 {
        100.0 * (self.planned - self.measured) / self.measured.max(1e-9)
    }
}

fn object(spec: &LinkSpec, planned: &Planned, stays: &[&str], checked: Option<Checked>) -> serde_json::Value {
    let flows = planned.flows.iter().map(|flow| {
        json!({
            "descriptor": flow.descriptor, "class": format!("{:?}", flow.class).to_lowercase(),
            "wanted_bytes_per_s": flow.wanted, "granted_bytes_per_s": flow.granted, "starves": flow.starves,
        })
    });
    let checked = checked.map(|checked| {
        json!({
            "planned_bytes_per_s": checked.planned, "measured_bytes_per_s": checked.measured,
            "off_percent": checked.off_percent(), "within_10_percent": checked.off_percent().abs() <= 10.0,
        })
    });
    json!({
        "check": checked, "link": spec.name, "rate_bytes_per_s": planned.rate, "overhead_bytes_per_s": planned.overhead,
        "flows": flows.collect::<Vec<_>>(), "stays": stays,
        "worst_command_s": planned.worst_command.as_secs_f64(), "resync_s": planned.resync.as_secs_f64(),
    })
}

fn print(spec: &LinkSpec, planned: &Planned, stays: &[&str], checked: Option<Checked>) {
    print_line(format_args!("{}: {:.0} bytes a second", spec.name, planned.rate));
    for flow in &planned.flows {
        let starves = if flow.starves { "  STARVES" } else { "" };
        let class = format!("{:?}", flow.class).to_lowercase();
        let (descriptor, wanted, granted) = (&flow.descriptor, flow.wanted, flow.granted);
        print_line(format_args!(
            "  {class:<8} {wanted:>8.1} wanted {granted:>8.1} granted  {descriptor}{starves}"
        ));
    }
    print_line(format_args!("  overhead {:>8.1}", planned.overhead));
    for descriptor in stays {
        print_line(format_args!("  no rule names {descriptor}: it stays here"));
    }
    print_line(format_args!(
        "  the worst command of a thousand takes {:.1} s; whole again {:.1} s after an outage",
        planned.worst_command.as_secs_f64(),
        planned.resync.as_secs_f64()
    ));
    if let Some(checked) = checked {
        print_line(format_args!(
            "  planned {:.1} bytes a second, a run took {:.1}: {:+.1} %",
            checked.planned,
            checked.measured,
            checked.off_percent()
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_are_read_whatever_colons_the_descriptor_has() {
        let load =
            |text: &str| text.parse::<Load>().map(|l| (l.descriptor, l.bytes, l.per_second, l.instances));
        assert_eq!(load("UMAA::X:64:0.5"), Ok(("UMAA::X".into(), 64, 0.5, 1)));
        assert_eq!(load("UMAA::X:64:0.5:10"), Ok(("UMAA::X".into(), 64, 0.5, 10)));
        for wrong in ["", "UMAA::X", "X:64", "X:64:-1", "X:a:1", "X:64:1:0"] {
            assert!(load(wrong).is_err(), "{wrong}");
        }
    }
}
