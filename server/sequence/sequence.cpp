#include "server/sequence/sequence.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "ies/core/number_text.h"
#include "protocol/schema/words.h"

namespace gonio::sequence {
namespace {

std::string word_of(const std::vector<double>& numbers) {
    std::string word;
    for (const double number : numbers) word += (word.empty() ? "" : ",") + number_text(number);
    return word;
}

// The slope of one number at a key of a smooth track, per second: from the key before to the one after, as far as there
// are.
double slope_at(const std::vector<Key>& keys, std::size_t key, std::size_t component) {
    const std::size_t before = key == 0 ? 0 : key - 1, after = std::min(key + 1, keys.size() - 1);
    const double time_s = keys[after].t_s - keys[before].t_s;
    return time_s > 0.0 ? (keys[after].numbers[component] - keys[before].numbers[component]) / time_s : 0.0;
}

// Cubic Hermite between two keys, u of the way.
double smooth_between(const std::vector<Key>& keys, std::size_t first, std::size_t component, double u) {
    const double a = keys[first].numbers[component], b = keys[first + 1].numbers[component],
                 time_s = keys[first + 1].t_s - keys[first].t_s;
    const double u2 = u * u, u3 = u2 * u;
    return a * (2 * u3 - 3 * u2 + 1) + b * (3 * u2 - 2 * u3) +
           time_s * (slope_at(keys, first, component) * (u3 - 2 * u2 + u) +
                     slope_at(keys, first + 1, component) * (u3 - u2));
}

}  // namespace

std::optional<Rate> parse_rate(const std::string& text) {
    const std::size_t slash = text.find('/');
    Rate rate;
    if (slash != std::string::npos) {
        const auto above = parse_count(text.substr(0, slash)), below = parse_count(text.substr(slash + 1));
        if (!above || !below || *above == 0 || *below == 0) return std::nullopt;
        rate = {*above, *below};
    } else {
        const auto number = parse_number(text);
        if (!number || !(*number >= 0.001 && *number <= 1000.0)) return std::nullopt;
        rate = {std::llround(*number * 1000.0), 1000};
        if (static_cast<double>(rate.numerator) / 1000.0 != *number) return std::nullopt;
    }
    const std::int64_t common = std::gcd(rate.numerator, rate.denominator);
    rate.numerator /= common;
    rate.denominator /= common;
    if (!(rate.per_second() >= 0.001 && rate.per_second() <= 1000.0)) return std::nullopt;
    return rate;
}

std::string value_at(const Track& track, double t_s) {
    const std::vector<Key>& keys = track.keys;
    const double begin_s = keys.front().t_s, time_s = keys.back().t_s - begin_s;
    if (time_s > 0.0 && t_s > begin_s && t_s < keys.back().t_s)
        t_s = begin_s + time_s * eased(track.ease, (t_s - begin_s) / time_s);
    const auto after =
        std::upper_bound(keys.begin(), keys.end(), t_s, [](double t, const Key& key) { return t < key.t_s; });
    const std::size_t first = after == keys.begin() ? 0 : static_cast<std::size_t>(after - keys.begin()) - 1;
    const Key& key = keys[first];
    if (key.numbers.empty()) return key.text;
    if (first + 1 == keys.size() || t_s <= key.t_s) return word_of(key.numbers);
    const double u = eased(key.ease, (t_s - key.t_s) / (keys[first + 1].t_s - key.t_s));
    std::vector<double> numbers(key.numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const double a = key.numbers[i], b = keys[first + 1].numbers[i];
        numbers[i] = track.smooth && key.ease != Ease::hold ? smooth_between(keys, first, i, u) : a + (b - a) * u;
    }
    return word_of(numbers);
}

std::string frame_name(const Sequence& sequence, int frame) {
    const std::size_t begin = sequence.out.find('#'), end = sequence.out.find_first_not_of('#', begin);
    std::string number = std::to_string(sequence.first_number + frame);
    if (number.size() < end - begin) number.insert(0, end - begin - number.size(), '0');
    return sequence.out.substr(0, begin) + number + sequence.out.substr(end);
}

std::optional<Shard> parse_shard(const std::string& text) {
    const std::size_t slash = text.find('/');
    if (slash == std::string::npos) return std::nullopt;
    const auto index = parse_count(text.substr(0, slash)), count = parse_count(text.substr(slash + 1));
    if (!index || !count || *count < 1 || *count > static_cast<unsigned>(kMostShards) || *index >= *count)
        return std::nullopt;
    return Shard{static_cast<int>(*index), static_cast<int>(*count)};
}

}  // namespace gonio::sequence
