//! The contract's numbers as people read them.

use reef_abi as abi;

/// Name of a status value.
pub(crate) fn status_name(status: i32) -> String {
    let name = match status {
        abi::OK => "REEF_OK",
        abi::SLEEP => "REEF_SLEEP",
        abi::DISCARD => "REEF_DISCARD",
        abi::ERROR => "REEF_ERROR",
        abi::FATAL => "REEF_FATAL",
        abi::UNSUPPORTED => "REEF_UNSUPPORTED",
        abi::BAD_STATE => "REEF_BAD_STATE",
        abi::NO_SPACE => "REEF_NO_SPACE",
        abi::BAD_INPUT => "REEF_BAD_INPUT",
        other => return format!("unknown status {other}"),
    };
    name.to_owned()
}

/// `major.minor` of a version number of the contract.
pub(crate) fn version_text(version: u32) -> String {
    format!("{}.{}", version >> 16, version & 0xffff)
}
