//! The process's Vulkan instance, which leaves screens alone.

use std::ffi::CStr;
use std::sync::OnceLock;
use wgpu::hal;

/// What an instance needs to draw on screens of Unix. Mesa's layer that chooses a device asks the screen where they are
/// enabled, and prints to stderr where there is none.
const SCREENS: [&CStr; 3] = [
    c"VK_KHR_wayland_surface",
    c"VK_KHR_xcb_surface",
    c"VK_KHR_xlib_surface",
];

/// The one instance of the process, which is never dropped: with the last one the Vulkan loader would unload the driver,
/// and NVIDIA's leaves each thread that has called it something to do at its end (seen with 580.159: a crash there).
/// `None` where there is no Vulkan.
pub(super) fn instance() -> Option<&'static wgpu::Instance> {
    static INSTANCE: OnceLock<Option<wgpu::Instance>> = OnceLock::new();
    INSTANCE.get_or_init(make).as_ref()
}

fn make() -> Option<wgpu::Instance> {
    let desc = hal::InstanceDescriptor {
        name: "etendue",
        // Validation layers and debug labels are for developing wgpu programs, at a price.
        flags: wgpu::InstanceFlags::empty(),
        memory_budget_thresholds: wgpu::MemoryBudgetThresholds::default(),
        backend_options: wgpu::BackendOptions::default(),
        telemetry: None,
        display: None,
    };
    let without_screens: Box<hal::vulkan::CreateInstanceCallback> =
        Box::new(|args| args.extensions.retain(|e| !SCREENS.contains(e)));
    // SAFETY: wgpu-hal takes these extensions where the loader has them, does without where not, and looks at the list
    // that it has created the instance with before it makes a surface; nobody here makes one. Everything else is as in
    // `wgpu::Instance::new`, and the instance is handed over whole.
    unsafe {
        let made = hal::vulkan::Instance::init_with_callback(&desc, Some(without_screens)).ok()?;
        Some(wgpu::Instance::from_hal::<hal::api::Vulkan>(made))
    }
}
