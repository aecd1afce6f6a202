#include "server/transport/bounces.h"

#include <algorithm>
#include <functional>

namespace gonio::transport {

namespace {

// While light moves. Light of surfels that the picture does not show is averaged once more before it comes there.
constexpr Followed kSeen{128, 256}, kUnseen{32, 64};

// sums[i] += share × the sum of what the table holds over the links `from` … `to` − 1 of surfels first … first + size
// − 1. Eight parameters: a run of links, what is carried, and a run of sums.
void transfer(const Links& links, unsigned from, unsigned to, const Table& table, float share, std::size_t first,
              std::size_t size, std::vector<glm::vec4>& sums) {
    for (const auto& set : links.sets) {
        const unsigned low = std::max(from, set->first), high = std::min(to, set->first + set->count);
        if (table.unit > 0.0f && low < high)
            gather(table, {set->ids.data() + first * set->count + (low - set->first), set->count, high - low, size},
                   share * table.unit, sums.data() + first);
    }
}

// The brightest tenth of the surfels, without those that send next to nothing.
struct Brightest {
    std::vector<std::uint16_t> ids;
    float narrow = 0.0f;  // 1 where they send all but a five-hundredth of the light, 0 where all but a hundredth
};
Brightest brightest_of(const Surfels& surfels, const std::vector<glm::vec4>& sent, Pool& pool) {
    const std::size_t n = surfels.count, few = n / 10;
    std::vector<float> power(n);
    const auto power_of = [&](std::size_t begin, std::size_t count) {
        double sum = 0.0;
        for (std::size_t i = begin; i < begin + count; ++i) {
            power[i] = surfels.area_m2[i] * (0.2126f * sent[i].r + 0.7152f * sent[i].g + 0.0722f * sent[i].b);
            sum += static_cast<double>(power[i]);
        }
        return sum;
    };
    const double all = pool.reduce_chunks(n, kSurfelsAJob, 0.0, power_of, std::plus<>());
    double theirs = 0.0;
    Brightest result;
    const double mean = all / static_cast<double>(std::max<std::size_t>(n, 1));
    // Were all but a hundredth of the light a tenth's, at most a twentieth more would send a fifth of the mean.
    const auto bright =
        std::count_if(power.begin(), power.end(), [&](float p) { return static_cast<double>(p) > 0.2 * mean; });
    if (static_cast<std::size_t>(bright) > few + n / 20) return result;
    for (std::size_t i = 0; i < n; ++i) {
        if (static_cast<double>(power[i]) > 0.02 * mean) result.ids.push_back(static_cast<std::uint16_t>(i));
    }
    if (result.ids.size() > few) {
        std::nth_element(result.ids.begin(), result.ids.begin() + static_cast<std::ptrdiff_t>(few), result.ids.end(),
                         [&](std::uint16_t a, std::uint16_t b) { return power[a] > power[b]; });
        result.ids.resize(few);
        std::sort(result.ids.begin(), result.ids.end());
    }
    for (const std::uint16_t id : result.ids) theirs += static_cast<double>(power[id]);
    result.narrow = static_cast<float>(glm::smoothstep(0.99, 0.998, theirs / std::max(all, 1e-300)));
    return result;
}

// Result: 1 where light comes from so few surfels that all links reversed to them are less than `most`, 0 where they
// are `none` or more.
float few_of(const Links& links, const Brightest& brightest, float most, float none) {
    unsigned each = 0;
    for (const auto& set : links.reversed) each += set->count;
    const float all = static_cast<float>(brightest.ids.size()) * static_cast<float>(each);
    return glm::clamp((none - all) / (none - most), 0.0f, 1.0f);
}

// out += the sum of what is sent over the reversed links of the brightest, those of the first generation and, with the
// weight `few`, of the others. Result: of how many links of each surfel.
float add_reversed(const Links& links, const Brightest& brightest, float few, const std::vector<glm::vec4>& sent,
                   std::vector<glm::vec4>& out, Pool& pool) {
    if (!(brightest.narrow > 0.0f)) return 0.0f;
    constexpr std::size_t kParts = 4;
    std::vector<std::vector<glm::vec4>> sums(kParts);
    std::vector<std::pair<const ReverseLinks*, float>> used;  // and the weight of its links
    float count = 0.0f;
    for (const auto& set : links.reversed) {
        const float weight = brightest.narrow * (used.empty() ? 1.0f : few);
        if (!(weight > 0.0f)) break;
        used.emplace_back(set.get(), weight);
        count += weight * static_cast<float>(set->count);
    }
    pool.run(kParts, [&](int part) {
        std::vector<glm::vec4>& sum = sums[static_cast<std::size_t>(part)];
        sum.assign(out.size(), glm::vec4(0.0f));
        for (std::size_t k = static_cast<std::size_t>(part); k < brightest.ids.size(); k += kParts) {
            const std::size_t j = brightest.ids[k];
            for (const auto& [set, weight] : used) {
                const glm::vec4 value = weight * sent[j];
                for (std::uint32_t at = set->first[j]; at < set->first[j + 1]; ++at) sum[set->from[at]] += value;
            }
        }
    });
    pool.run_chunks(out.size(), kSurfelsAJob, [&](std::size_t begin, std::size_t size) {
        for (std::size_t i = begin; i < begin + size; ++i) out[i] += sums[0][i] + sums[1][i] + sums[2][i] + sums[3][i];
    });
    return count;
}

}  // namespace

void radiosity(const Surfels& surfels, std::span<const float> passed, float share, std::span<const glm::vec4> direct,
               std::span<const glm::vec4> indirect, std::vector<glm::vec4>& out, Pool& pool) {
    out.resize(surfels.count);
    pool.run_chunks(surfels.count, kSurfelsAJob, [&](std::size_t first, std::size_t count) {
        for (std::size_t i = first; i < first + count; ++i)
            out[i] = glm::vec4(surfels.albedo[i], 0.0f) *
                     (share * direct[i] + (indirect.empty() ? glm::vec4(0.0f) : indirect[i]));
        for (std::size_t i = first; i < first + count && !passed.empty(); ++i) out[i] *= passed[i];
    });
}

Bounces::Bounces(const Surfels& surfels, const Links& links, std::span<const glm::vec4> direct,
                 std::span<const glm::vec4> exact, std::span<const glm::vec4> haze, const BounceSettings& settings,
                 Pool& pool)
    : surfels_(surfels),
      links_(links),
      direct_(direct),
      seen_(settings.rests ? std::span<const std::uint8_t>() : settings.seen),
      pool_(pool),
      shown_(kSeen),
      unseen_(kUnseen),
      rest_(surfels.count, glm::vec4(0.0f)) {
    radiosity(surfels_, links_.passed, 1.0f, direct_, {}, sent_, pool_);
    const unsigned there = std::min(links.per_surfel(), settings.links);
    const bool reversed = settings.links > there && !links.reversed.empty();
    const Brightest brightest = reversed || settings.rests ? brightest_of(surfels, sent_, pool) : Brightest();
    narrow_ = brightest.narrow;
    std::vector<glm::vec4> from_crowded;
    if (links.crowded && !links.crowded->to.empty()) take_crowded(settings.rests, from_crowded);
    make_table(sent_, table_, pool_);
    const float few = settings.rests ? 1.0f : few_of(links, brightest, 2.5e6f, 3.5e6f);
    const float more = exact.empty() && reversed ? add_reversed(links, brightest, few, sent_, rest_, pool) : 0.0f;
    const float exactly = exact.empty() ? 0.0f : narrow_;
    // So many reversed links of the first generation stand for the links that later bounces do not follow.
    const float others = more > 0.0f ? 1.0f - narrow_ * (1.0f - few) : 1.0f;
    // The fewer surfels are bright the noisier it is, and the sooner done: time for links that only rest has otherwise.
    const float beyond = settings.rests ? 1.0f : narrow_ * few_of(links, brightest, 1e6f, 1.5e6f);
    shown_.all += static_cast<unsigned>(beyond * static_cast<float>(kMostForwardLinks - shown_.all)) / 16 * 16;
    for (Followed* some : {&unseen_, &shown_})
        some->near = std::min(some->near, there), some->all = std::min(some->all, there);
    // Links that count in the first bounce alone, and the part of it that those of every bounce find.
    const auto first_alone = [&](const Followed& followed) {
        return others * static_cast<float>(followed.all - followed.near) + more;
    };
    const auto near = static_cast<float>(shown_.near);
    carried_ = (1.0f - exactly) * near / std::max(near + first_alone(shown_), 1.0f);
    for_all([&](std::size_t first, std::size_t size, const Followed& own) {
        const float share = (1.0f - exactly - carried_) / std::max(first_alone(own), 1.0f);
        for (std::size_t i = first; i < first + size && narrow_ > 0.0f; ++i)
            rest_[i] = exact.empty() ? share * rest_[i] : exactly * exact[i];
        transfer(links, own.near, own.all, table_, others * share, first, size, rest_);
        for (std::size_t i = first; i < first + size && !from_crowded.empty(); ++i)
            rest_[i] += (1.0f - exactly) * from_crowded[i];
        for (std::size_t i = first; i < first + size && !haze.empty(); ++i) rest_[i] += haze[i];
    });
}

// Moves the direct light of crowded surfels from what links carry to `out`, where it arrives. While light moves only
// that of the bright ones: of others, such as those around another luminaire, links do not make more noise than of all.
void Bounces::take_crowded(bool rests, std::vector<glm::vec4>& out) {
    constexpr float kBright = 2.0f;  // times what a surfel sends on the mean
    constexpr std::size_t kParts = 2;
    const auto most = [](const glm::vec4& sent) { return std::max({sent.r, sent.g, sent.b}); };
    float bright = 0.0f;
    if (!rests && !sent_.empty()) {
        const auto sum_of = [&](std::size_t first, std::size_t size) {
            float sum = 0.0f;
            for (const glm::vec4& sent : std::span(sent_).subspan(first, size)) sum += most(sent);
            return sum;
        };
        bright = kBright * pool_.reduce_chunks(sent_.size(), kSurfelsAJob, 0.0f, sum_of, std::plus<>()) /
                 static_cast<float>(sent_.size());
    }
    std::vector<std::uint32_t> numbers;  // in all_crowded
    for (std::uint32_t n = 0; n < surfels_.all_crowded.size(); ++n)
        if (most(sent_[surfels_.all_crowded[n].id]) > bright) numbers.push_back(n);
    if (numbers.empty()) return;
    std::vector<glm::vec4> parts[kParts];
    pool_.run(kParts, [&](int part) {
        std::vector<glm::vec4>& sum = parts[part];
        sum.assign(surfels_.count, glm::vec4(0.0f));
        for (std::size_t k = static_cast<std::size_t>(part); k < numbers.size(); k += kParts) {
            const glm::vec4 sent = sent_[surfels_.all_crowded[numbers[k]].id];
            links_.crowded->each(numbers[k], [&](std::size_t i, float form_factor) { sum[i] += form_factor * sent; });
        }
    });
    out = std::move(parts[0]);
    uncrowded_.resize(direct_.size());
    pool_.run_chunks(out.size(), kSurfelsAJob, [&](std::size_t first, std::size_t size) {
        for (std::size_t i = first; i < first + size; ++i) out[i] += parts[1][i], uncrowded_[i] = direct_[i];
    });
    for (const std::uint32_t n : numbers) {
        const std::size_t id = surfels_.all_crowded[n].id;
        uncrowded_[id] = sent_[id] = glm::vec4(0.0f);
    }
    direct_ = uncrowded_;
}

void Bounces::send(float share, std::span<const glm::vec4> indirect) {
    radiosity(surfels_, links_.passed, share, direct_, indirect, sent_, pool_);
    make_table(sent_, table_, pool_);
}

// job(first, size, followed) for runs of surfels that follow the same links.
template <typename Job>
void Bounces::for_all(const Job& job) const {
    pool_.run_chunks(surfels_.count, kSurfelsAJob, [&](std::size_t first, std::size_t size) {
        if (seen_.empty()) return job(first, size, shown_);
        for (std::size_t i = first, end = i; i < first + size; i = end) {
            while (end < first + size && seen_[end] == seen_[i]) ++end;
            job(i, end - i, seen_[i] != 0 ? shown_ : unseen_);
        }
    });
}

void Bounces::bounce(std::span<const glm::vec4> e, std::vector<glm::vec4>& out) {
    send(carried_, e);
    out.resize(surfels_.count);
    for_all([&](std::size_t first, std::size_t size, const Followed& own) {
        std::copy_n(rest_.begin() + static_cast<std::ptrdiff_t>(first), size,
                    out.begin() + static_cast<std::ptrdiff_t>(first));
        transfer(links_, 0, own.near, table_, 1.0f / static_cast<float>(std::max(own.near, 1u)), first, size, out);
    });
}

}  // namespace gonio::transport
