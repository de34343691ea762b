// SPDX-License-Identifier: GPL-3.0-or-later
// What the allocator keeps of freed memory, given back to the system.
#pragma once

namespace afterglow {

/// Takes some milliseconds: for the seams of a final render, where what was freed and what comes next differ in size.
/// Does nothing where the C library has no such function.
void release_free_memory();

}  // namespace afterglow
