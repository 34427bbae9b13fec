//! Stages of the network for [`srrf_cloud::profile`].

use burn::tensor::Device;
use srrf_cloud::profile;

/// Runs `job` as the stage `name`. While stages are timed, waits until `device` has done it, for a GPU
/// computes after the call has returned.
pub(crate) fn timed<T>(name: &'static str, device: &Device, job: impl FnOnce() -> T) -> T {
    profile::stage(name, || {
        let result = job();
        if profile::is_on() {
            // A device that cannot go on says so where its numbers are read.
            drop(device.sync());
        }
        result
    })
}
