//! `<Service …>`: what each service of OpenUxAS is here, in one table.

use super::Import;
use super::bridges::is_true;
use super::toml::quoted;
use super::tree::Element;
use std::path::{Component, Path, PathBuf};

/// What a service of OpenUxAS is here.
struct Row {
    /// Its names in OpenUxAS.
    names: &'static [&'static str],
    /// What it is here.
    here: Here,
    /// The attributes that it reads.
    attributes: &'static [(&'static str, Value)],
}

/// The equivalent of a service.
enum Here {
    /// A `[[service]]` of this kind.
    Service(&'static str),
    /// None, and why not or what to do instead.
    Nothing(&'static str),
}

/// What an attribute is here.
enum Value {
    /// A key with a number.
    Number(&'static str),
    /// A key with `true` or `false`.
    Flag(&'static str),
    /// A key with a text, in capitals.
    Capitals(&'static str),
    /// A key with a text.
    Text(&'static str),
    /// A key with the name of a file, without which the service has nothing to work with.
    File(&'static str),
    /// Read by OpenUxAS, but of no meaning here, and why.
    Nothing(&'static str),
    /// Read together with the children.
    Children,
}

use Here::{Nothing, Service};
use Value::{Capitals, File, Flag, Number, Text};

/// Every service of OpenUxAS that configurations name. What is a `Service` of a kind that this program has not is told as
/// having no equivalent, so that a new kind needs nothing here but its row.
const ROWS: &[Row] = &[
    Row {
        names: &["AutomationRequestValidatorService"],
        here: Service("automation-request-validator"),
        attributes: &[("MaxResponseTime_ms", Number("max_response_time_ms"))],
    },
    Row { names: &["TaskManagerService"], here: Service("task-manager"), attributes: &[] },
    Row { names: &["SensorManagerService"], here: Service("sensor-manager"), attributes: &[] },
    Row {
        names: &["RouteAggregatorService"],
        here: Service("route-aggregator"),
        attributes: &[("FastPlan", Flag("fast_plan"))],
    },
    Row {
        names: &["RoutePlannerVisibilityService"],
        here: Service("route-planner-visibility"),
        attributes: &[
            ("TurnRadiusOffset_m", Number("turn_radius_offset_m")),
            ("MinimumWaypointSeparation_m", Number("minimum_waypoint_separation_m")),
            ("isRoutAggregator", Value::Nothing("the aggregator is a service of its own")),
            ("OsmFileName", Value::Nothing("roads are an OsmPlannerService's")),
        ],
    },
    Row {
        names: &["AssignmentTreeBranchBoundService"],
        here: Service("assignment-tree-branch-bound"),
        attributes: &[
            ("NumberNodesMaximum", Number("number_nodes_maximum")),
            ("CostFunction", Capitals("cost_function")),
        ],
    },
    Row {
        names: &["PlanBuilderService"],
        here: Service("plan-builder"),
        attributes: &[
            ("AssignmentStartPointLead_m", Number("assignment_start_point_lead_m")),
            ("AddLoiterToEndOfMission", Flag("add_loiter_to_end_of_mission")),
            ("DefaultLoiterRadius_m", Number("default_loiter_radius_m")),
            ("TurnType", Text("turn_type")),
        ],
    },
    Row {
        names: &["OperatingRegionStateService"],
        here: Service("operating-region-state"),
        attributes: &[("AdditionalPadding", Number("additional_padding_m"))],
    },
    Row {
        names: &["WaypointPlanManagerService"],
        here: Service("waypoint-plan-manager"),
        attributes: &[
            ("VehicleID", Number("vehicle")),
            ("NumberWaypointsToServe", Number("number_waypoints_to_serve")),
            ("NumberWaypointsOverlap", Number("number_waypoints_overlap")),
            ("DefaultLoiterRadius_m", Number("default_loiter_radius_m")),
            ("AddLoiterToEndOfSegments", Flag("add_loiter_to_end_of_segments")),
            ("AddLoiterToEndOfMission", Flag("add_loiter_to_end_of_mission")),
            ("LoopBackToFirstTask", Flag("loop_back_to_first_task")),
            ("SetLastWaypointSpeedTo0", Flag("set_last_waypoint_speed_to_0")),
            ("TurnType", Text("turn_type")),
            ("GimbalPayloadId", Number("gimbal_payload")),
        ],
    },
    Row {
        names: &["SendMessagesService"],
        here: Service("send-messages"),
        attributes: &[("PathToMessageFiles", Value::Children)],
    },
    Row {
        names: &["MessageLoggerDataService"],
        here: Service("recorder"),
        attributes: &[
            ("LogFileName", Value::Nothing("files are named by their times")),
            ("LogFileMessageCountLimit", Number("messages_per_file")),
            ("FilesPerSubDirectory", Value::Nothing("all files stand in one directory")),
        ],
    },
    Row {
        names: &["HelloWorld"],
        here: Nothing("it is an example; `aldis pub` says anything, and `send-messages` repeats it"),
        attributes: &[("StringToSend", Value::Nothing("")), ("SendPeriod_ms", Value::Nothing(""))],
    },
    Row {
        names: &["StatusReportService"],
        here: Nothing("health reports of every service, and `aldis fleet`, tell who is there"),
        attributes: &[
            ("VehicleID", Value::Nothing("")),
            ("ReportPeriod_ms", Value::Nothing("")),
            ("StaleStateTime_ms", Value::Nothing("")),
            ("KeepAliveExpiration_ms", Value::Nothing("")),
        ],
    },
    Row {
        names: &["Test_SimulationTime"],
        here: Nothing("the time of a node is that of its machine"),
        attributes: &[],
    },
    Row {
        names: &["AutomationDiagramDataService"],
        here: Nothing("`aldis record` keeps what the diagrams are drawn from"),
        attributes: &[],
    },
    Row {
        names: &["BatchSummaryService"],
        here: Nothing("it is not built"),
        attributes: &[("FastPlan", Value::Nothing(""))],
    },
    Row {
        names: &["OsmPlannerService"],
        here: Service("osm-planner"),
        attributes: &[
            ("OsmFile", File("osm_file")),
            ("MapEdgesFile", Value::Nothing("the map is not drawn")),
            ("ShortestPathFile", Value::Nothing("ways are told in answers alone")),
            ("MetricsFile", Value::Nothing("`aldis bench plan` measures")),
        ],
    },
];

/// Writes a service with a service id; says whether it took the id.
pub(super) fn service(element: &Element, id: u32, import: &mut Import<'_>) -> bool {
    let name = element.attribute("Type").unwrap_or_default();
    let nothing = |why: &str| format!("{} has no equivalent: {why}", element.title());
    let Some(row) = ROWS.iter().find(|row| row.names.contains(&name)) else {
        import.remark(element.line, nothing("no service of this name is known"));
        return false;
    };
    let read: Vec<_> = row.attributes.iter().map(|(name, _)| *name).chain(["Type"]).collect();
    import.unread(element, &read);
    let title = format!("Line {}: {name}", element.line);
    match row.here {
        Nothing(why) => {
            import.remark(element.line, nothing(why));
            false
        }
        Service(kind) if super::super::Service::KINDS.contains(&kind) => {
            if let Some(missing) = missing_file(element, row, import) {
                import.remark(element.line, nothing(&format!("there is no file `{}`", missing.display())));
                return false;
            }
            import.out.table("service", &title);
            import.out.key("kind", quoted(kind));
            import.out.key("service", id);
            attributes(element, row, import);
            true
        }
        Service(_) => {
            import.remark(element.line, nothing("this program has no such service yet"));
            false
        }
    }
}

/// A file that a service cannot be without and that is not there.
fn missing_file(element: &Element, row: &Row, import: &Import<'_>) -> Option<PathBuf> {
    let files = row.attributes.iter().filter(|(_, value)| matches!(value, File(_)));
    let mut named =
        files.map(|(name, _)| place(import.directory, element.attribute(name).unwrap_or_default()));
    named.find(|file| !file.is_file())
}

fn attributes(element: &Element, row: &Row, import: &mut Import<'_>) {
    for (name, value) in row.attributes {
        let Some(text) = element.attribute(name) else { continue };
        let wrong = |what: &str| format!("`{name}` = `{text}` of {} is no {what}: left out", element.title());
        match value {
            Number(key) => match text.trim().parse::<f64>() {
                Ok(number) if number.is_finite() => import.out.key(key, text.trim()),
                _ => import.remark(element.line, wrong("number")),
            },
            Flag(key) => import.out.key(key, is_true(text)),
            Capitals(key) => import.out.key(key, quoted(&text.to_ascii_uppercase())),
            Text(key) => import.out.key(key, quoted(text)),
            File(key) => {
                import.out.key(key, quoted(&place(import.directory, text).display().to_string()));
            }
            Value::Nothing(why) => {
                import.remark(
                    element.line,
                    format!("`{name}` of {} has no equivalent: {why}", element.title()),
                );
            }
            Value::Children => {}
        }
    }
    match row.here {
        Service("send-messages") => messages(element, import),
        Service("task-manager") => options(element, import),
        Service("recorder") => kept(element, import),
        _ => {
            for child in &element.children {
                let text = format!("`{}` of {} is not understood", child.name, element.title());
                import.remark(child.line, text);
            }
        }
    }
}

/// What is recorded, into the directory where OpenUxAS keeps it: below that in which the program was started.
fn kept(element: &Element, import: &mut Import<'_>) {
    let directory = PathBuf::from("datawork/SavedMessages");
    let directory = std::path::absolute(&directory).unwrap_or(directory);
    import.out.key("directory", quoted(&directory.display().to_string()));
    let mut addresses = Vec::new();
    for child in &element.children {
        match child.attribute("MessageType").filter(|_| child.name == "LogMessage") {
            Some(kind) => addresses.push(quoted(kind)),
            None => import.remark(child.line, format!("`{}` names no `MessageType`", child.name)),
        }
        if child.attribute("NumberMessagesToSkip").is_some_and(|count| count.trim() != "0") {
            let text = format!("`NumberMessagesToSkip` of {}: every message is kept", child.title());
            import.remark(child.line, text);
        }
    }
    import.out.key("addresses", format!("[{}]", addresses.join(", ")));
}

/// Options of tasks, one for each `Option` of a `TaskOptions`.
fn options(element: &Element, import: &mut Import<'_>) {
    let mut rows = Vec::new();
    for group in &element.children {
        let of = |key: &str, attribute: &str, quote: bool| {
            let value = group.attribute(attribute)?;
            Some(format!("{key} = {}, ", if quote { quoted(value) } else { value.to_owned() }))
        };
        let whose = of("task_id", "TaskId", false).or_else(|| of("task_type", "TaskType", true));
        for option in &group.children {
            let (name, value) = (option.attribute("OptionName"), option.attribute("Value"));
            let (name, value) = (quoted(name.unwrap_or_default()), quoted(value.unwrap_or_default()));
            let whose = whose.as_deref().unwrap_or_default();
            rows.push(format!("  {{ {whose}name = {name}, value = {value} }},\n"));
        }
    }
    if !rows.is_empty() {
        import.out.key("options", format!("[\n{}]", rows.concat()));
    }
}

/// Messages that are sent at times.
fn messages(element: &Element, import: &mut Import<'_>) {
    let given = element.attribute("PathToMessageFiles").unwrap_or_default();
    let directory = place(import.directory, given);
    import.out.key("directory", quoted(&directory.display().to_string()));
    let mut rows = Vec::new();
    for child in &element.children {
        let Some(file) = child.attribute("MessageFileName").filter(|_| child.name == "Message") else {
            import.remark(child.line, format!("`{}` names no `MessageFileName`", child.name));
            continue;
        };
        // OpenUxAS passes over a file that it cannot read.
        if let Ok(bytes) = std::fs::read(directory.join(file))
            && let Err(why) = aldis_envelope::lmcp::read_xml(&bytes)
        {
            import.remark(child.line, format!("`{file}` is left out: {why}"));
            continue;
        }
        import.unread(
            child,
            &["MessageFileName", "MessageKey", "SendTime_ms", "SendPeriod_ms", "NumberTimesToSend"],
        );
        let mut row = format!("  {{ file = {}", quoted(file));
        for (attribute, key) in
            [("SendTime_ms", "time_ms"), ("SendPeriod_ms", "period_ms"), ("NumberTimesToSend", "times")]
        {
            match child.attribute(attribute).map(|text| (text, text.trim().parse::<f64>())) {
                Some((_, Ok(number))) if number >= 0.0 => {
                    row += &format!(", {key} = {}", number.round() as u64)
                }
                Some((text, _)) => {
                    import.remark(child.line, format!("`{attribute}` = `{text}` is no time: left out"));
                }
                None => {}
            }
        }
        rows.push(row + " },\n");
    }
    import.out.key("messages", format!("[\n{}]", rows.concat()));
}

/// Where a file or a directory is. OpenUxAS is run in a directory below that of its configuration, and takes the path from there:
/// `../MessagesToSend/` lies beside the configuration.
fn place(configuration: &Path, given: &str) -> PathBuf {
    let configuration = &std::path::absolute(configuration).unwrap_or_else(|_| configuration.to_owned());
    let plain = configuration.join(given);
    if plain.exists() {
        return plain;
    }
    let mut from_below = configuration.to_owned();
    let mut parts = Path::new(given).components().peekable();
    if parts.peek() == Some(&Component::ParentDir) {
        parts.next();
    }
    from_below.extend(parts);
    from_below
}
