#include "protocol/schema/word_table.h"

#include <algorithm>
#include <charconv>
#include <numbers>

#include "protocol/schema/words.h"
#include "protocol/text/css_color.h"
#include "protocol/text/did_you_mean.h"

namespace gonio {
namespace {

using Words = std::span<const std::string>;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

constexpr WordRow kChangeOptions[] = {
    {"--base-rev", "N", WordForm::count, "", "refused where somebody else changed the same after revision N"},
};

Error usage(std::string_view where, std::string_view value, std::string message) {
    return {"usage", std::string(where), std::string(value), std::move(message)};
}

void fail(ReadWords& read, Error fault) {
    if (!read.fault) read.fault = std::move(fault);
}

std::string_view last_word(std::string_view name) {
    return name.substr(name.rfind(' ') + 1);  // npos + 1 is 0
}

// What a value says: numbers in the units of messages, or texts.
struct Value {
    std::vector<double> numbers;
    std::vector<std::string> texts;
    bool automatic = false;
    std::optional<bool> on;
};
using MaybeValue = std::optional<Value>;
using Text = const std::string&;

MaybeValue numbers_value(std::optional<double> number, double factor = 1) {
    return number ? MaybeValue({{*number * factor}, {}}) : std::nullopt;
}

MaybeValue ratio_value(Text text) {
    if (!text.ends_with('%')) return numbers_value(parse_number(text));
    const auto percent = parse_number(std::string_view(text).substr(0, text.size() - 1));
    return percent ? numbers_value(*percent / 100) : std::nullopt;
}

MaybeValue vector_value(Text text) {
    auto numbers = parse_vector(text);
    return numbers ? MaybeValue({std::move(*numbers), {}}) : std::nullopt;
}

MaybeValue color_value(Text text) {
    const auto color = parse_css_color(text);
    return color ? MaybeValue({{color->begin(), color->end()}, {}}) : vector_value(text);
}

MaybeValue vector_or_auto_value(Text text) {
    return text == "auto" ? Value() : vector_value(text);
}

MaybeValue size_value(Text text) {
    const auto size = parse_size(text);
    return size && size->first > 0 && size->second > 0 ? MaybeValue({{double(size->first), double(size->second)}, {}})
                                                       : std::nullopt;
}

MaybeValue positive_count_value(Text text) {
    const auto count = parse_count(text);
    return count && *count > 0 ? numbers_value(count) : std::nullopt;
}

MaybeValue edge_samples_value(Text text) {
    const auto samples = parse_count(text);
    return samples && *samples >= 1 && *samples <= 64 ? numbers_value(samples) : std::nullopt;
}

MaybeValue number_or_auto_value(Text text) {
    if (text != "auto") return numbers_value(parse_number(text));
    return Value{{}, {}, true};
}

MaybeValue seconds_value(Text text) {
    const std::size_t slash = text.find('/');
    if (slash == text.npos) return numbers_value(parse_number(text));
    const auto part = parse_number(text.substr(0, slash)), whole = parse_number(text.substr(slash + 1));
    return part && whole ? numbers_value(*part / *whole) : std::nullopt;
}

MaybeValue on_or_off_value(Text text) {
    if (text != "on" && text != "off") return std::nullopt;
    Value value;
    value.on = text == "on";
    return value;
}

MaybeValue range_value(Text text) {
    if (text == "auto") return Value{{}, {}, true};
    const std::size_t colon = std::min(text.find(':'), text.size());
    const auto low = parse_number(text.substr(0, colon)),
               high = parse_number(text.substr(std::min(colon + 1, text.size())));
    return low && high ? MaybeValue({{*low, *high}, {}}) : std::nullopt;
}

MaybeValue whole_value(Text text) {
    std::int32_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return numbers_value(std::optional(value));
}

MaybeValue names_value(Text text) {
    Value value;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t comma = std::min(text.find(',', at), text.size());
        value.texts.push_back(text.substr(at, comma - at));
        at = comma + 1;
    }
    return value;
}

MaybeValue picture_value(Text text) {
    const auto format = capture_format(text);
    return format ? MaybeValue({{}, {*format}}) : std::nullopt;
}

MaybeValue scene_file_value(Text text) {
    const auto format = scene_format(text);
    return format ? MaybeValue({{}, {*format}}) : std::nullopt;
}

struct FormRow {
    WordForm form;
    const char* expected;  // what a refusal says that the value must be
    MaybeValue (*read)(Text);
};
constexpr FormRow kForms[] = {
    {WordForm::flag, "", [](Text) { return MaybeValue(Value()); }},
    {WordForm::text, "",
     [](Text text) {
         return MaybeValue(Value{{}, {text}});
     }},
    {WordForm::names, "", names_value},
    {WordForm::number, "a number", [](Text text) { return numbers_value(parse_number(text)); }},
    {WordForm::ratio, "a number or a percentage, like 0.5 or 50%", ratio_value},
    {WordForm::degrees, "a number", [](Text text) { return numbers_value(parse_number(text), kRadPerDeg); }},
    {WordForm::count, "a whole number, 0 or more", [](Text text) { return numbers_value(parse_count(text)); }},
    {WordForm::positive_count, "a whole number above 0", positive_count_value},
    {WordForm::whole, "a whole number from -2147483648 to 2147483647", whole_value},
    {WordForm::edge_samples, "a whole number from 1 to 64", edge_samples_value},
    {WordForm::vector, "numbers with commas between, like 1,2,3", vector_value},
    {WordForm::color, "three numbers with commas between, like 1,0.5,0, a colour of CSS, like orange, or #ff8800",
     color_value},
    {WordForm::vector_or_auto, "up to 16 numbers with commas between, like 100,200,500, or auto", vector_or_auto_value},
    {WordForm::size, "two whole numbers above 0 with an x between, like 800x600", size_value},
    {WordForm::seconds, "a number or a fraction, like 0.5 or 1/60", seconds_value},
    {WordForm::on_or_off, "on or off", on_or_off_value},
    {WordForm::number_or_auto, "a number or auto", number_or_auto_value},
    {WordForm::range, "two numbers with a colon between, like 0:1000, or auto", range_value},
    {WordForm::picture, "a .png, .jpg or .exr file", picture_value},
    {WordForm::scene_file, "a .glb or .mvr file", scene_file_value},
};
static_assert([] {
    for (std::size_t i = 0; i < std::size(kForms); ++i)
        if (static_cast<std::size_t>(kForms[i].form) != i) return false;
    return true;
}());

// Result: the message and its field that a path names, "command.set_light.level_ratio"; messages on the way are made.
std::pair<Message*, const FieldDescriptor*> named_field(Message* message, std::string_view path) {
    for (;;) {
        const std::size_t dot = path.find('.');
        const FieldDescriptor* field = message->GetDescriptor()->FindFieldByName(std::string(path.substr(0, dot)));
        if (dot == path.npos) return {message, field};
        message = message->GetReflection()->MutableMessage(message, field);
        path.remove_prefix(dot + 1);
    }
}

// Result: the message that the command fills.
Message* target(ReadWords& read) {
    if (read.command->message.empty()) return &read.message;
    const auto [message, field] = named_field(&read.message, read.command->message);
    return message->GetReflection()->MutableMessage(message, field);
}

void put(Message* whole, const WordRow& row, const Value& value) {
    const auto [message, field] = named_field(whole, row.field);
    const auto& to = *message->GetReflection();
    if (row.form == WordForm::flag || value.on) to.SetBool(message, field, value.on.value_or(true));
    for (Text text : value.texts)
        field->is_repeated() ? to.AddString(message, field, text) : to.SetString(message, field, text);
    if (field->is_repeated() && value.texts.empty()) to.ClearField(message, field);  // the last of two options counts
    const int after = row.form == WordForm::range ? 2 : 1;
    if (value.automatic)
        to.SetBool(message, message->GetDescriptor()->FindFieldByNumber(field->number() + after), true);
    for (std::size_t i = 0; i < value.numbers.size(); ++i) {
        const double number = value.numbers[i];
        const int next = field->number() + static_cast<int>(i);
        const auto* one = field->is_repeated() ? field : message->GetDescriptor()->FindFieldByNumber(next);
        if (one->cpp_type() == FieldDescriptor::CPPTYPE_UINT32) {
            const auto count = static_cast<std::uint32_t>(number);
            one->is_repeated() ? to.AddUInt32(message, one, count) : to.SetUInt32(message, one, count);
        } else if (one->cpp_type() == FieldDescriptor::CPPTYPE_INT32) {
            to.SetInt32(message, one, static_cast<std::int32_t>(number));
        } else if (one->cpp_type() == FieldDescriptor::CPPTYPE_BOOL) {
            to.SetBool(message, one, number != 0);
        } else {
            one->is_repeated() ? to.AddDouble(message, one, number) : to.SetDouble(message, one, number);
        }
    }
}

// where: the place of the fault.
void take_value(ReadWords& read, const WordRow& row, std::string_view where, Text text) {
    const FormRow& form = kForms[static_cast<std::size_t>(row.form)];
    const auto value = form.read(text);
    constexpr double kLeastPercent = 2, kMostPercent = 100;  // numbers that no ratio is near, but percentages may be
    if (const double number = row.form == WordForm::ratio && value && !text.ends_with('%') ? value->numbers[0] : 0;
        number >= kLeastPercent && number <= kMostPercent)
        return fail(read, usage(where, text, "This must be from 0 to 1, or a percentage. Did you mean " + text + "%?"));
    if (!value) return fail(read, usage(where, text, std::string("This must be ") + form.expected + "."));
    if (!row.field.empty()) put(target(read), row, *value);
}

// Result: how many of a command's names there must be at least and at most.
std::pair<std::size_t, std::size_t> name_counts(const WordCommand& command) {
    std::size_t least = 0;
    bool many = false;
    for (const WordRow& row : command.names) {
        if (!row.name.starts_with('[')) ++least;
        many = many || row.name.find("…") != row.name.npos;
    }
    return {least, many ? std::string::npos : command.names.size()};
}

std::vector<const WordRow*> options_here(const ReadWords& read, const Grammar& grammar) {
    std::vector<const WordRow*> options;
    const auto own = read.command ? read.command->options : std::span<const WordRow>();
    for (const auto rows : {own, grammar.common, std::span<const WordRow>(kChangeOptions)})
        for (const WordRow& row : rows) options.push_back(&row);
    return options;
}

const WordRow* find_option(const ReadWords& read, const Grammar& grammar, std::string_view name) {
    for (const WordRow* row : options_here(read, grammar))
        if (row->name == name) return row;
    return nullptr;
}

void take_option(ReadWords& read, const Grammar& grammar, Words words, std::size_t& i) {
    const std::string& word = words[i];
    const std::size_t equals = word.find('=');
    const std::string name = word == "-h" ? "--help" : word.substr(0, equals);
    const bool joined = equals != word.npos;
    const WordRow* row = find_option(read, grammar, name);
    if (!row) {
        std::vector<std::string_view> known;
        for (const WordRow* option : options_here(read, grammar)) known.push_back(option->name);
        std::string why = "There is no such option here." + did_you_mean(name, known);
        // "-5 dB" may well be a light.
        if (!word.starts_with("--")) why += " A name that begins with a dash comes last, after two: -- '" + word + "'.";
        return fail(read, usage(name, "", std::move(why)));
    }
    std::string value = joined ? word.substr(equals + 1) : "";
    if (row->form == WordForm::flag) {
        if (joined) return fail(read, usage(name, value, "This option has no value."));
    } else if (!joined) {
        if (i + 1 == words.size() || find_option(read, grammar, words[i + 1]))
            return fail(read, usage(name, "", "This option needs a value."));
        value = words[++i];
    }
    take_value(read, *row, name, value);
    read.options[row->name] = std::move(value);
}

// Result: the words that may stand here: after "set" light, camera and so on, after nothing set, get and so on.
std::vector<std::string_view> next_words(std::span<const WordCommand> table, std::string_view group) {
    std::vector<std::string_view> words;
    for (const WordCommand& command : table) {
        std::string_view name = command.name;
        if (!group.empty() && !name.starts_with(std::string(group) + " ")) continue;
        if (!group.empty()) name.remove_prefix(group.size() + 1);
        name = name.substr(0, name.find(' '));
        if (std::find(words.begin(), words.end(), name) == words.end()) words.push_back(name);
    }
    return words;
}

// What people type who know other programs, and what it is called here.
struct Hint {
    std::string_view word, use;
};
constexpr Hint kHints[] = {
    {"info", "get, or stats"},
    {"status", "stats"},
    {"list", "light list; likewise group, cue, grid, view, preset"},
    {"ls", "light list"},
    {"lights", "light list"},
    {"groups", "group list"},
    {"cues", "cue list"},
    {"presets", "preset list"},
    {"views", "view list"},
    {"grids", "grid list"},
    {"delete", "remove light NAME; for others cue remove, grid remove, view remove, preset remove"},
    {"rm", "remove light NAME"},
    {"render", "capture OUT.png"},
    {"screenshot", "capture OUT.png"},
    {"go", "cue go"},
    {"back", "cue back"},
    {"stop", "cue stop"},
    {"goto", "cue goto NUMBER"},
    {"record", "cue add NUMBER, or preset save NAME"},
    {"blackout", "set master 0"},
    {"master", "set master RATIO"},
    {"dim", "set light NAME --level RATIO"},
    {"level", "set light NAME --level RATIO"},
    {"camera", "set camera"},
    {"exposure", "set exposure EV"},
    {"import", "load scene FILE"},
    {"export", "save scene OUT.glb"},
};

// Result: " Use gonio X." for a word that is no command, but a habit; empty: it is none.
std::string hint_for(const ReadWords& read, std::string_view word) {
    const auto found = std::ranges::find(kHints, word, &Hint::word);
    if (!read.group.empty() || found == std::end(kHints)) return {};
    return " Use: gonio " + std::string(found->use) + ".";
}

// word: what stands in place of a command's word; empty: nothing.
Error no_such_command(const ReadWords& read, const Grammar& grammar, std::string_view word) {
    const auto known = next_words(grammar.table, read.group);
    std::string message = word.empty() ? "There is no command." : "There is no such command.";
    if (!read.group.empty()) message = "After " + read.group + " comes one of:";
    for (const std::string_view name : known)
        if (!read.group.empty()) message += " " + std::string(name);
    const std::string hint = hint_for(read, word);
    return usage(read.group, word,
                 message + (read.group.empty() ? "" : ".") + (hint.empty() ? did_you_mean(word, known) : hint));
}

void take_command_word(ReadWords& read, const Grammar& grammar, const std::string& word) {
    if (read.fault) return;
    const auto known = next_words(grammar.table, read.group);
    if (std::find(known.begin(), known.end(), word) == known.end()) {
        if (!read.group.empty() || grammar.implied.empty()) return fail(read, no_such_command(read, grammar, word));
        read.group = grammar.implied;
        return take_command_word(read, grammar, word);
    }
    const std::string name = read.group.empty() ? word : read.group + " " + word;
    for (const WordCommand& command : grammar.table)
        if (command.name == name) read.command = &command;
    if (read.command)
        target(read);
    else
        read.group = word;
}

// Result: whether the word goes on with the command's name: "list" after "group", which is a command by itself.
bool goes_on(ReadWords& read, const Grammar& grammar, const std::string& word) {
    if (!read.names.empty()) return false;
    const std::string name = std::string(read.command->name) + " " + word;
    const auto longer = std::ranges::find(grammar.table, name, &WordCommand::name);
    if (longer == grammar.table.end()) return false;
    read.command = &*longer;
    read.message.Clear();
    target(read);
    return true;
}

void take_name(ReadWords& read, const std::string& word) {
    const auto& rows = read.command->names;
    if (read.names.size() == name_counts(*read.command).second)
        return fail(read, usage("", word, "This word is one too many."));
    const WordRow& row = rows[std::min(read.names.size(), rows.size() - 1)];
    take_value(read, row, last_word(read.command->name), word);
    read.names.push_back(word);
}

// What can be said of the words when all are read.
void finish(ReadWords& read, const Grammar& grammar) {
    if (!read.command) return fail(read, no_such_command(read, grammar, ""));
    const WordCommand& command = *read.command;
    if (read.names.size() < name_counts(command).first)
        fail(read, usage("", "", std::string(command.names[read.names.size()].name) + " is missing."));
    if (command.name.starts_with("set ") && !command.names.empty() && read.names.empty() && read.options.empty())
        fail(read, usage("", "", std::string(command.names.front().name) + " is missing."));
    for (const std::string_view option : command.needs)
        if (!option.empty() && !read.has(option))
            fail(read, usage(option, "", std::string(command.name) + " needs this option."));
    if (!read.has("--base-rev")) return;
    if (!command.message.starts_with("command.")) return fail(read, usage("--base-rev", "", "This changes no scene."));
    if (const auto rev = parse_count(read.options["--base-rev"])) read.message.mutable_command()->set_base_rev(*rev);
}

}  // namespace

ReadWords read_words(Words words, const Grammar& grammar) {
    ReadWords read;
    bool only_names = false;
    for (std::size_t i = 0; i < words.size(); ++i) {
        const std::string& word = words[i];
        const bool is_option = !only_names && word.starts_with('-') && word != "-" && !parse_number(word);
        if (is_option && word == "--")
            only_names = true;
        else if (is_option)
            take_option(read, grammar, words, i);
        else if (read.command && !only_names && goes_on(read, grammar, word))
            continue;
        else if (read.command)
            take_name(read, word);
        else
            take_command_word(read, grammar, word);
    }
    finish(read, grammar);
    return read;
}

std::span<const WordRow> change_options() {
    return kChangeOptions;
}

}  // namespace gonio
