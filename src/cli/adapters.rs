//! `etendue adapters`.

use super::failure::Failure;
use crate::gpu;

/// Lists the adapters in order of preference, and says which one a render would use.
pub fn adapters() -> Result<(), Failure> {
    let mut text = String::new();
    let mut taken = false;
    for adapter in gpu::adapters() {
        let kind = if adapter.device.software {
            "software"
        } else {
            "hardware"
        };
        let verdict = match &adapter.usable {
            Ok(()) if !taken => "used by default".to_owned(),
            Ok(()) => "usable with --adapter".to_owned(),
            Err(why) => format!("not usable: {why}"),
        };
        taken |= adapter.usable.is_ok();
        text += &format!(
            "{} ({}, {kind}): {verdict}\n",
            adapter.device.name, adapter.device.driver
        );
    }
    text += if taken {
        "CPU reference: used with --backend cpu\n"
    } else {
        "CPU reference: used by default, as there is no usable adapter\n"
    };
    super::write_stdout(&text)?;
    if !taken {
        super::say!(
            "help: to install a software adapter: {}",
            super::backend::GET_ADAPTER
        );
    }
    Ok(())
}
