// SPDX-License-Identifier: MIT
// Stands in until the folder has a source of its own.
