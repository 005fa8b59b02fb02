// SPDX-License-Identifier: Apache-2.0
// PRESCENE_SANITIZES_MEMORY is 1 in a build with the address or thread sanitizer, which slow the program down and
// replace its allocator, and 0 otherwise.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)  // g++
#define PRESCENE_SANITIZES_MEMORY 1
#elif defined(__clang__)  // headers of libraries define __has_feature for g++, as 0
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PRESCENE_SANITIZES_MEMORY 1
#endif
#endif

#if !defined(PRESCENE_SANITIZES_MEMORY)
#define PRESCENE_SANITIZES_MEMORY 0
#endif
