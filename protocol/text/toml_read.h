// Reading TOML that people write: every refusal names line, column and value. Only for .cpp files, because it brings
// toml++.
#pragma once

#include <functional>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>

#include "ies/core/result.h"

// toml++ asserts on some texts that are no TOML ("[\x1b"): here that is an exception like its others.
namespace gonio::toml_read {
[[noreturn]] inline void assertion() {
    throw std::runtime_error("the text is not TOML");
}
}  // namespace gonio::toml_read
#define TOML_UNRELEASED_FEATURES 0  // among them keys of any script, whose table has holes
#define TOML_ASSERT(condition) ((condition) ? void() : gonio::toml_read::assertion())
#define TOML_ASSERT_ASSUME(condition) TOML_ASSERT(condition)
#include <toml++/toml.h>

namespace gonio::toml_read {

// What is read and how it is refused.
struct Text {
    std::string_view text;
    std::size_t most_bytes;
    const char* code;  // of refusals
    const char* what;  // "a patch file"
};

// Calls `take` with the parsed file. Result: true. Errors: `code` with "line L column C" as place and the offending
// value, "too_large", and what `take` refuses.
Result<bool> read(const Text& text, const std::function<void(const toml::table&)>& take);

// The following are for inside `take`; refusals leave it through an exception that `read` turns into its error.
[[noreturn]] void refuse(const toml::source_region& at, std::string value, std::string message);
[[noreturn]] void refuse(Error error);
void only_keys(const toml::table& table, std::initializer_list<std::string_view> known, std::string_view what);
std::string text_of(const toml::node& node);  // for errors
std::uint32_t whole_number(const toml::node& node, std::int64_t low, std::int64_t high, const char* what);
double number(const toml::node& node, const char* what);  // finite
bool yes_or_no(const toml::node& node, const char* what);
std::string word(const toml::node& node, const char* what);
struct Range {
    double low, high;
};
Range range(const toml::node& node);  // [low, high]

// Result: a TOML basic string, as a file holds it; of numbers ies/core/number_text.h.
std::string quoted(const std::string& text);

}  // namespace gonio::toml_read
