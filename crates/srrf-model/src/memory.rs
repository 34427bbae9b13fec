//! How the process holds memory.

/// Tells glibc to keep freed memory; other allocators are left as they are. Call it first in
/// `main`.
///
/// A network frees and takes back the same tens of megabytes at every operation. By default glibc
/// returns blocks of that size to the kernel each time, and the page faults that follow cost a
/// third of a training step and more.
pub fn keep_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: mallopt only sets parameters of the allocator; the values are within its limits.
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, 1 << 30);
            libc::mallopt(libc::M_TRIM_THRESHOLD, i32::MAX);
            libc::mallopt(libc::M_TOP_PAD, 64 << 20);
        }
    }
}
