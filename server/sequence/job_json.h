// A JOB.json that is read field by field: each step that does not fit says where. Only for .cpp files, because it
// brings nlohmann::json.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ies/core/result.h"

namespace gonio::job {

using Json = nlohmann::json;

inline constexpr std::size_t kMostShownValue = 120;  // bytes of a value that an error repeats

// Thrown by all below. place: "sequence.tracks[2].keys[0].t".
struct Refused {
    std::string place;
    Error error;
};

[[noreturn]] void refuse(const std::string& place, Error error);
// The code is "bad_job".
[[noreturn]] void refuse(const std::string& place, const std::string& value, const std::string& message);
[[noreturn]] void refuse(const std::string& place, const char* value, const std::string& message);
[[noreturn]] void refuse(const std::string& place, const Json& value, const std::string& message);

template <typename T>
T checked(const std::string& place, Result<T> result) {
    if (!result) refuse(place, result.error());
    return std::move(*result);
}

// Result: "place[i]".
std::string item(const std::string& place, std::size_t i);

// Refuses what is no object, and fields that none of these names is.
void expect_object(const Json& object, const std::string& place, std::initializer_list<const char*> names);
// Results: the field's value, or what is given where there is none; numbers are finite.
std::string text_at(const Json& object, const char* key, const std::string& place, const std::string& otherwise);
std::optional<double> number_at(const Json& object, const char* key, const std::string& place);
double number_within(const Json& object, const char* key, const std::string& place, double least, double most,
                     std::optional<double> otherwise);
int whole_within(const Json& object, const char* key, const std::string& place, int least, int most,
                 std::optional<int> otherwise);
bool flag_at(const Json& object, const char* key, const std::string& place);
// Result: the list, at least `least` and at most `most` long; an empty one where there is no such field and least is 0.
const Json& list_at(const Json& object, const char* key, const std::string& place, std::size_t least, std::size_t most);
// Result: a list of strings.
std::vector<std::string> words_of(const Json& words, const std::string& place);

// Reads the file. Refuses what is no regular file, longer than 16 MiB, no JSON, nested deeper than 64, or no object.
inline constexpr std::size_t kMaxJobBytes = 16u << 20;
Json read_job(const std::string& file);

}  // namespace gonio::job
