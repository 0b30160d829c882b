//! Results of the stages of `hydro gap`, as its report reads them.

use hydro_gap::records::Record;
use hydro_plugin::report::gap::{headline, page};

/// Reads the stages' results and writes the report.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(record) = serde_json::from_slice::<Record>(bytes) else {
        return false;
    };
    assert!(!headline(&record.verdict, &record.named.chosen).is_empty());
    let page = page(&record);
    assert!(page.ends_with("</body></html>\n"));
    assert!(!page.contains("<script"), "a script in the report");
    true
}
