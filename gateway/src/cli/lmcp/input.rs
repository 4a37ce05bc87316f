//! Files, standard input, and the objects in them.

use super::super::exit::Failure;
use aldis_envelope::lmcp::{Object, Placed, read_json, read_xml};
use std::io::Read;
use std::path::Path;

/// The bytes of a file; of standard input where the path is `-`.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let read = if path.as_os_str() == "-" {
        std::io::stdin().lock().read_to_end(&mut bytes).map(drop)
    } else {
        std::fs::File::open(path).and_then(|mut file| file.read_to_end(&mut bytes)).map(drop)
    };
    match read {
        Ok(()) => Ok(bytes),
        Err(why) => Err(Failure::Usage(format!("cannot read {}: {why}", path.display()))),
    }
}

/// The objects of an XML file in its order, a scenario's too. What was passed over is said on standard error.
pub(in super::super) fn objects_of_xml(path: &Path, bytes: &[u8]) -> Result<Vec<Placed>, Failure> {
    let name = path.display();
    let document = read_xml(bytes).map_err(|why| Failure::Failed(format!("{name}: {why}")))?;
    for warning in &document.warnings {
        eprintln!("aldis: {name}: {warning}; passed over");
    }
    if document.more_warnings > 0 {
        eprintln!("aldis: {name}: {} more passed over", document.more_warnings);
    }
    if document.objects.is_empty() {
        let why = "no LMCP object: no element has the attribute Series and a known type";
        return Err(Failure::Failed(format!("{name}: {why}")));
    }
    Ok(document.objects)
}

/// The objects of a JSON file: one, several in a row, or an array of them; each may stand by itself or as the member
/// `object`, as `aldis lmcp decode` prints those of a stream.
pub(in super::super) fn objects_of_json(path: &Path, bytes: &[u8]) -> Result<Vec<Box<dyn Object>>, Failure> {
    let objects = read_json(bytes)
        .map_err(|(place, why)| Failure::Failed(format!("{}: object {place}: {why}", path.display())))?;
    if objects.is_empty() {
        return Err(Failure::Failed(format!("{}: no JSON value", path.display())));
    }
    Ok(objects)
}
