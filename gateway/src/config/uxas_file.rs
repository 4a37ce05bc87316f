//! Configurations of OpenUxAS (`<UxAS EntityID=…> <Bridge …/> <Service …/>`) as configurations of this program.
//!
//! What has an equivalent is written as TOML; what has none is told by name, and so is every attribute that nothing reads.

mod bridges;
mod services;
mod toml;
mod tree;

use std::path::Path;
use tree::Element;

/// Where a remark stands in the file, and what it says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Remark {
    /// The line, from 1.
    pub(crate) line: usize,
    /// In words.
    pub(crate) text: String,
}

/// A configuration of OpenUxAS, translated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Imported {
    /// The configuration that does the same, as far as it can be.
    pub(crate) toml: String,
    /// What has no equivalent, and what nothing reads, in the order of the file.
    pub(crate) remarks: Vec<Remark>,
}

/// Why a file is no configuration of OpenUxAS.
#[derive(Debug, thiserror::Error)]
pub(crate) enum UxasFileError {
    /// It cannot be read.
    #[error("cannot read {0}: {1}")]
    Unreadable(String, std::io::Error),
    /// It is no XML.
    #[error("{file}:{line}: {why}")]
    Malformed {
        /// The file.
        file: String,
        /// The line, from 1.
        line: usize,
        /// What is wrong there.
        why: String,
    },
}

/// What is gathered while a file is translated.
struct Import<'a> {
    /// The directory of the file.
    directory: &'a Path,
    remarks: Vec<Remark>,
    out: toml::Out,
}

impl Import<'_> {
    fn remark(&mut self, line: usize, text: impl Into<String>) {
        self.remarks.push(Remark { line, text: text.into() });
    }

    /// Warns about attributes that nothing reads.
    fn unread(&mut self, element: &Element, known: &[&str]) {
        for attribute in &element.attributes {
            if !known.contains(&attribute.name.as_str()) {
                let text = format!("nothing reads the attribute `{}` of {}", attribute.name, element.title());
                self.remark(element.line, text);
            }
        }
    }
}

/// Translates a file.
///
/// # Errors
/// [`UxasFileError`]: the file cannot be read, or is no configuration of OpenUxAS.
pub(crate) fn import(path: &Path) -> Result<Imported, UxasFileError> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|why| UxasFileError::Unreadable(file.clone(), why))?;
    let malformed = |(line, why)| UxasFileError::Malformed { file: file.clone(), line, why };
    let root = tree::read(&bytes).map_err(malformed)?;
    translate(&root, path).map_err(malformed)
}

fn translate(root: &Element, path: &Path) -> Result<Imported, (usize, String)> {
    if root.name != "UxAS" {
        return Err((root.line, format!("the root element is `{}`, not `UxAS`", root.name)));
    }
    let id = root.attribute("EntityID").ok_or((root.line, "`UxAS` has no `EntityID`".to_owned()))?;
    let entity = id.parse::<u64>().ok().and_then(|id| aldis_envelope::EntityId::new(id).ok());
    let entity = entity.ok_or((root.line, format!("`{id}` is no entity id")))?.get();
    let directory = path.parent().filter(|path| !path.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let out = toml::Out::new(&path.file_name().unwrap_or_default().to_string_lossy(), entity);
    let mut import = Import { directory, remarks: Vec::new(), out };
    head(root, &mut import);
    let mut numbers = (20, 100);
    for child in &root.children {
        match child.name.as_str() {
            "Bridge" => numbers.0 += u32::from(bridges::bridge(child, numbers.0, &mut import)),
            "Service" => numbers.1 += u32::from(services::service(child, numbers.1, &mut import)),
            other => import.remark(child.line, format!("`{other}` is neither a `Bridge` nor a `Service`")),
        }
    }
    // Every UxAS has one, without saying so.
    import.out.table("service", "The service manager");
    import.out.key("kind", toml::quoted("service-manager"));
    import.out.key("service", numbers.1);
    import.remarks.sort_by_key(|remark| remark.line);
    let Import { out, remarks, .. } = import;
    Ok(Imported { toml: out.finish(&remarks), remarks })
}

/// The service that a `CreateNewService` asks for: an element `Service` whose end may be missing, escaped or not.
///
/// # Errors
/// Why there is no such service here.
pub(crate) fn service(xml: &str, entity: u64, id: u32) -> Result<super::Service, String> {
    let text = match xml.trim_start().starts_with('<') {
        true => xml.to_owned(),
        false => quick_xml::escape::unescape(xml).map_err(|why| why.to_string())?.into_owned(),
    };
    let whole = |text: &str| tree::read(text.as_bytes()).map_err(|(_, why)| why);
    let element = whole(&text).or_else(|_| whole(&format!("{text}</Service>")))?;
    if element.name != "Service" {
        return Err(format!("`{}` is no `Service`", element.name));
    }
    let out = toml::Out::new("CreateNewService", entity);
    let mut import = Import { directory: Path::new("."), remarks: Vec::new(), out };
    if !services::service(&element, id, &mut import) {
        return Err(import.remarks.first().map(|remark| remark.text.clone()).unwrap_or_default());
    }
    let config = super::Config::parse("CreateNewService", &import.out.finish(&[]));
    let config = config.map_err(|why| format!("{}: {}", element.title(), why.message()))?;
    config.services.into_iter().next().ok_or_else(|| format!("{} is no service here", element.title()))
}

/// The attributes of the whole.
fn head(root: &Element, import: &mut Import<'_>) {
    import.unread(
        root,
        &[
            "EntityID",
            "FormatVersion",
            "EntityType",
            "ConsoleLoggerSeverityLevel",
            "MainFileLoggerSeverityLevel",
            "StartDelay_ms",
            "RunDuration_s",
        ],
    );
    for (attribute, why) in [
        ("RunDuration_s", "a node runs until it is stopped"),
        ("StartDelay_ms", "a node starts at once"),
        ("MainFileLoggerSeverityLevel", "the log goes to standard error alone"),
    ] {
        if let Some(value) = root.attribute(attribute) {
            import.remark(root.line, format!("`{attribute}` = {value} has no equivalent: {why}"));
        }
    }
    let Some(level) = root.attribute("ConsoleLoggerSeverityLevel") else { return };
    match level.to_ascii_uppercase().as_str() {
        "DEBUG" | "DEBUGGING" => import.out.log("debug"),
        "INFO" => import.out.log("info"),
        "WARN" | "WARNING" => import.out.log("warn"),
        "ERROR" | "ERRORS" => import.out.log("error"),
        other => import.remark(root.line, format!("`{other}` is no level of the log")),
    }
}

#[cfg(test)]
mod tests;
