// Text fields of packets: fixed width, zero-terminated, from anybody.
#pragma once

#include <string>
#include <string_view>

#include "protocol/text/byte_order.h"
#include "protocol/text/shortened_text.h"

namespace gonio {

// Result: the bytes up to the first zero as UTF-8; control characters (unseen_length) and what is not UTF-8 become '?',
// so that the text may go into JSON and onto a terminal.
std::string printable_text(Bytes bytes);
// Result: the length of the well-formed UTF-8 sequence at `at`, 1 to 4, or 0 (Unicode 15, table 3-7).
std::size_t utf8_length(Bytes bytes, std::size_t at);
// Result: the length of a character that is not shown but changes what is; 0: it is none. Such are C0, C1, line and
// paragraph separators, and overrides and isolates of the direction of writing (U+202A … 202E, U+2066 … 2069).
std::size_t unseen_length(Bytes bytes, std::size_t at);
// Result: the first `most` bytes as printable ASCII, others replaced by '?': for the offending values of errors.
std::string shown_text(std::string_view text, std::size_t most = 32);

}  // namespace gonio
