// Text fields of packets: fixed width, zero-terminated, from anybody.
#pragma once

#include <string>
#include <string_view>

#include "ies/core/text.h"
#include "protocol/text/byte_order.h"
#include "protocol/text/shortened_text.h"

namespace gonio {

// Result: the bytes up to the first zero as UTF-8. Control characters (unseen_length) and what is not UTF-8 become '?',
// so that the text may go into JSON and onto a terminal.
std::string printable_text(Bytes bytes);
// Result: the length of a character that is not shown but changes what is; 0: it is none. Such are C0, C1, line and
// paragraph separators, and overrides and isolates of the direction of writing (U+202A … 202E, U+2066 … 2069).
std::size_t unseen_length(std::string_view text, std::size_t at);
// Result: 0 to 15; -1: it is no hexadecimal digit.
int hex_digit(char c);

}  // namespace gonio
