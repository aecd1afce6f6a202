#include "server/sequence/job_json.h"

#include <algorithm>
#include <cmath>

#include "server/base/bounded_file.h"

namespace gonio::job {
namespace {

constexpr int kMostDepth = 64;
constexpr std::size_t kMostWords = 4096;

std::string shown(const Json& value) {
    std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (text.size() > kMostShownValue) text = text.substr(0, kMostShownValue) + "…";
    return text;
}

}  // namespace

void refuse(const std::string& place, Error error) {
    throw Refused{place, std::move(error)};
}
void refuse(const std::string& place, const std::string& value, const std::string& message) {
    refuse(place, Error{"bad_job", "", value, message});
}
void refuse(const std::string& place, const char* value, const std::string& message) {
    refuse(place, std::string(value), message);
}
void refuse(const std::string& place, const Json& value, const std::string& message) {
    refuse(place, Error{"bad_job", "", shown(value), message});
}

std::string item(const std::string& place, std::size_t i) {
    return place + "[" + std::to_string(i) + "]";
}

void expect_object(const Json& object, const std::string& place, std::initializer_list<const char*> names) {
    if (!object.is_object()) refuse(place, object, "must be an object");
    for (const auto& [name, value] : object.items())
        if (std::ranges::find(names, name) == names.end())
            refuse(place + "." + name.substr(0, kMostShownValue), value, "there is no such field");
}

std::string text_at(const Json& object, const char* key, const std::string& place, const std::string& otherwise) {
    if (!object.contains(key)) return otherwise;
    if (!object[key].is_string() || object[key].get_ref<const std::string&>().empty())
        refuse(place + "." + key, object[key], "must be a string that is not empty");
    return object[key];
}

std::optional<double> number_at(const Json& object, const char* key, const std::string& place) {
    if (!object.contains(key)) return std::nullopt;
    if (!object[key].is_number()) refuse(place + "." + key, object[key], "must be a number");
    return object[key].get<double>();
}

double number_within(const Json& object, const char* key, const std::string& place, double least, double most,
                     std::optional<double> otherwise) {
    const auto number = number_at(object, key, place);
    if (!number && otherwise) return *otherwise;
    if (!number || !(*number >= least && *number <= most))
        refuse(place + "." + key, number ? object[key] : Json(""),
               "must be a number from " + print_number(least) + " to " + print_number(most));
    return *number;
}

int whole_within(const Json& object, const char* key, const std::string& place, int least, int most,
                 std::optional<int> otherwise) {
    const auto number = number_at(object, key, place);
    if (!number && otherwise) return *otherwise;
    if (!number || *number != std::floor(*number) || !(*number >= least && *number <= most))
        refuse(place + "." + key, number ? object[key] : Json(""),
               "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most));
    return static_cast<int>(*number);
}

bool flag_at(const Json& object, const char* key, const std::string& place) {
    if (!object.contains(key)) return false;
    if (!object[key].is_boolean()) refuse(place + "." + key, object[key], "must be true or false");
    return object[key];
}

const Json& list_at(const Json& object, const char* key, const std::string& place, std::size_t least,
                    std::size_t most) {
    static const Json none = Json::array();
    if (!object.contains(key)) {
        if (least > 0) refuse(place + "." + key, "", "must be a list");
        return none;
    }
    const Json& list = object[key];
    if (!list.is_array()) refuse(place + "." + key, list, "must be a list");
    if (list.size() < least || list.size() > most)
        refuse(place + "." + key, std::to_string(list.size()),
               "must have " + std::to_string(least) + " to " + std::to_string(most) + " entries");
    return list;
}

std::vector<std::string> words_of(const Json& words, const std::string& place) {
    std::vector<std::string> list;
    if (!words.is_array()) refuse(place, words, "must be a list of words");
    if (words.empty() || words.size() > kMostWords)
        refuse(place, std::to_string(words.size()), "must have 1 to " + std::to_string(kMostWords) + " words");
    for (const Json& word : words) {
        if (!word.is_string()) refuse(place, word, "must be a string");
        list.push_back(word);
    }
    return list;
}

Json read_job(const std::string& file) {
    const auto text = read_bounded_file(file, kMaxJobBytes);
    if (!text) refuse(file, "", "the job " + text.error().message);
    if (text->size() > kMaxJobBytes) refuse(file, "", "a job may have at most 16 MiB");
    bool too_deep = false;
    const auto watch = [&](int depth, Json::parse_event_t, Json&) {
        too_deep |= depth > kMostDepth;
        return !too_deep;
    };
    Json job;
    try {
        job = Json::parse(*text, watch);
    } catch (const Json::parse_error& error) {
        refuse(file, "byte " + std::to_string(error.byte), "the job is not JSON");
    } catch (const Json::out_of_range&) {
        refuse(file, "", "the job has a number beyond double precision");
    }
    if (too_deep) refuse(file, "", "a job may be nested at most " + std::to_string(kMostDepth) + " deep");
    if (!job.is_object()) refuse(file, job, "the job must be an object");
    return job;
}

}  // namespace gonio::job
