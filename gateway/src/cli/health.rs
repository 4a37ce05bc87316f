//! `aldis health`: the latest health report of every resource.

use super::exit::Failure;
use super::member::Join;
use super::print_line;
use super::retained::Retained;
use super::within::Within;
use crate::clock;
use aldis_envelope::umaa::{self, ErrorCode, ErrorCondition, HealthReport, Topic};
use aldis_envelope::{EntityId, Envelope, Guid, Guids, Wall};
use serde_json::json;

/// Show the latest health report of every resource, as their reporters retain them.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis health                              everything
  aldis health --severity WARN,FAIL,ERROR   what needs somebody
  aldis health --of 400 --since 10m     what vehicle 400 reported in the last ten minutes")]
pub(crate) struct HealthArgs {
    /// Only these severities: ERROR, FAIL, INFO, NONE, WARN.
    #[arg(long, value_delimiter = ',', value_name = "SEVERITY")]
    severity: Vec<ErrorCondition>,
    /// Only these codes: ACTUATOR, FILESYS, NONE, POWER, PROCESSOR, RAM, ROM, SENSOR, SOFTWARE.
    #[arg(long, value_delimiter = ',', value_name = "CODE")]
    code: Vec<ErrorCode>,
    /// Only this resource, by its GUID.
    #[arg(long, value_name = "GUID")]
    resource: Option<Guid>,
    /// Only reports of this entity's services.
    #[arg(long, value_name = "EID")]
    of: Option<EntityId>,
    /// Only reports made in this last span of time, by their reporters' clocks.
    #[arg(long, value_name = "SPAN")]
    since: Option<Within>,
    /// One JSON object a report.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

impl HealthArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let guids = self.join.guids()?;
        let retained = Retained::read(&self.join, &[HealthReport::NAME])?;
        let mut shown = 0;
        for envelope in retained.samples() {
            let report: HealthReport = match umaa::decode(&envelope.message.content) {
                Ok(report) => report,
                Err(why) => {
                    eprintln!("aldis: {}: {why}", envelope.message.label.source());
                    continue;
                }
            };
            if self.wants(envelope, &report) {
                shown += 1;
                self.print(&guids, envelope, &report);
            }
        }
        if shown == 0 && !self.json {
            print_line("no report");
        }
        if !retained.complete {
            eprintln!("aldis: not every node has answered: there may be more reports");
        }
        Ok(())
    }

    fn wants(&self, envelope: &Envelope, report: &HealthReport) -> bool {
        let made = Wall::from(report.time_stamp);
        let is_recent = |since: &Within| made.0 >= clock::wall().0.saturating_sub(since.0.as_nanos() as i64);
        (self.severity.is_empty() || self.severity.contains(&report.severity))
            && (self.code.is_empty() || self.code.contains(&report.code))
            && self.resource.is_none_or(|resource| resource == report.resource_id)
            && self.of.is_none_or(|entity| entity == envelope.message.label.source().entity)
            && self.since.as_ref().is_none_or(is_recent)
    }

    fn print(&self, guids: &Guids, envelope: &Envelope, report: &HealthReport) {
        let reporter = envelope.message.label.source();
        let resource = named(guids, report.resource_id);
        if self.json {
            print_line(json!({
                "resource": resource, "resource_id": report.resource_id, "reporter": reporter.to_string(),
                "severity": report.severity, "code": report.code, "status": report.status,
                "log_time": Wall::from(report.log_time).to_string(),
                "time_stamp": Wall::from(report.time_stamp).to_string(),
            }));
            return;
        }
        let time = Wall::from(report.time_stamp);
        let entity = reporter.entity;
        print_line(format_args!(
            "{time} {:<5} {:<9} entity {entity} {resource}: {}",
            report.severity, report.code, report.status
        ));
    }
}

/// A resource by its ids, where its GUID tells them.
fn named(guids: &Guids, guid: Guid) -> String {
    guids.service(guid).map_or_else(|| guid.to_string(), |source| source.to_string())
}
