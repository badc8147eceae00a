/* OpenImageIO behind picture/oiio.h: the only C++ of the programs. Exceptions end here. */
extern "C" {
#include "base/files.h"
}

#include "picture/oiio.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <string>

#include <strings.h>
#include <zlib.h>

namespace
{

using OIIO::ImageInput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

constexpr int max_channels = 1024;
constexpr size_t max_png = 1u << 30; /* bytes */

struct release {
    void operator()(void *memory) const { std::free(memory); }
};
using memory = std::unique_ptr<void, release>;

/* OpenImageIO's own pool would add threads that nobody asked for. */
void configure_once()
{
    static std::once_flag once;
    std::call_once(once, [] {
        OIIO::attribute("threads", 1);
        OIIO::attribute("exr_threads", -1);
    });
}

/* The library's words, of which the first line is kept, after the image's name, which some of them begin with. */
int complain(const char *name, std::string why, base_err *err)
{
    why.resize(std::min(why.find('\n'), why.size()));
    if (why.compare(0, std::strlen(name), name) == 0)
        return base_fail(err, BASE_EINVAL, "%s", why.c_str());
    return base_fail(err, BASE_EINVAL, "%s: not an image that can be read: %s", name,
                     why.empty() ? "unknown reason" : why.c_str());
}

/* --- which channels --- */

struct selection {
    int part, count, at[4]; /* channels of the file, count of them */
};

/* R, G, B by name, else the first three, else the first one repeated. */
selection find_rgb(const ImageSpec &spec)
{
    static const char *const names[3] = {"R", "G", "B"};
    selection s = {0, 3, {0, 0, 0}};
    int found = 0;
    for (int c = 0; c < 3; c++) {
        const auto at = std::find(spec.channelnames.begin(), spec.channelnames.end(), names[c]);
        found += at != spec.channelnames.end();
        s.at[c] = static_cast<int>(at - spec.channelnames.begin());
    }
    for (int c = 0; c < 3 && found != 3; c++)
        s.at[c] = spec.nchannels >= 3 ? c : 0;
    return s;
}

/* In the first part that has it; count is 0 if none has. */
selection find_channel(ImageInput &input, const char *channel)
{
    for (int part = 0; input.seek_subimage(part, 0); part++) {
        const ImageSpec &spec = input.spec();
        const auto at = std::find(spec.channelnames.begin(), spec.channelnames.end(), channel);
        if (at != spec.channelnames.end())
            return {part, 1, {static_cast<int>(at - spec.channelnames.begin())}};
    }
    return {0, 0, {0}};
}

selection choose(ImageInput &input, const pic_request &q)
{
    if (q.wanted == PIC_CHANNEL)
        return find_channel(input, q.channel);
    return q.wanted == PIC_DISPLAY ? find_rgb(input.spec())
                                   : selection{0, std::min(input.spec().nchannels, 4), {0, 1, 2, 3}};
}

/* --- pixels --- */

int check_size(const ImageSpec &spec, const char *name, base_err *err)
{
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.nchannels > max_channels)
        return base_fail(err, BASE_EINVAL, "%s: not a 2-D image of 1 to %d channels (%dx%dx%d, %d channels)", name,
                         max_channels, spec.width, spec.height, spec.depth, spec.nchannels);
    if (spec.width > PIC_MAX_SIDE || spec.height > PIC_MAX_SIDE ||
        static_cast<long long>(spec.width) * spec.height > PIC_MAX_PIXELS)
        return base_fail(err, BASE_EINVAL, "%s: %dx%d pixels (expected at most 2^27 in all, and 32768 on a side)", name,
                         spec.width, spec.height);
    return 0;
}

int read_pixels(ImageInput &input, const pic_request &q, pic_image *out, base_err *err)
{
    const selection s = choose(input, q);
    if (q.wanted == PIC_CHANNEL && s.count == 0)
        return base_fail(err, BASE_EINVAL, "%s: has no channel '%s'", q.name, q.channel);
    const ImageSpec spec = input.spec_dimensions(s.part, 0);
    if (int rc = check_size(spec, q.name, err))
        return rc;
    const bool is_float = spec.format.is_floating_point();
    const bool is_codes = q.wanted == PIC_DISPLAY ? !is_float : q.wanted == PIC_STORED && spec.format == TypeDesc::UINT8;
    const TypeDesc type = is_codes ? TypeDesc::UINT8 : TypeDesc::FLOAT;
    const int lo = *std::min_element(s.at, s.at + s.count), hi = *std::max_element(s.at, s.at + s.count) + 1;
    const size_t pixels = static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height), size = type.size(),
                 count = static_cast<size_t>(s.count), span = static_cast<size_t>(hi - lo);
    memory values(std::calloc(pixels * span, size));
    if (!values)
        return base_fail_nomem(err, q.name);
    if (!input.read_image(s.part, 0, lo, hi, type, values.get()))
        return complain(q.name, input.geterror(), err);
    bool in_order = span == count;
    for (int c = 0; c < s.count; c++)
        in_order = in_order && s.at[c] == lo + c;
    if (!in_order) {
        memory ordered(std::malloc(pixels * count * size));
        if (!ordered)
            return base_fail_nomem(err, q.name);
        for (size_t i = 0; i < pixels; i++)
            for (size_t c = 0; c < count; c++)
                std::memcpy(static_cast<char *>(ordered.get()) + (i * count + c) * size,
                            static_cast<char *>(values.get()) + (i * span + static_cast<size_t>(s.at[c] - lo)) * size, size);
        values.swap(ordered);
    }
    *out = pic_image{spec.width, spec.height, s.count, is_float, nullptr, nullptr, 0};
    if (is_codes)
        out->u8 = static_cast<uint8_t *>(values.release());
    else
        out->f32 = static_cast<float *>(values.release());
    return 0;
}

/* --- files and memory --- */

/* Keeps alpha as stored: pbrt never premultiplies. */
ImageSpec raw_config()
{
    ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    return config;
}

bool is_png(const char *name)
{
    const char *dot = std::strrchr(name, '.');
    return dot != nullptr && strcasecmp(dot, ".png") == 0;
}

/* libpng prints on stderr when a file is damaged (and OpenImageIO then leaks), so damage is found before it sees the data:
 * signature, chunk lengths, checksums, end marker (PNG specification, §5). */
int check_png(const char *name, const unsigned char *data, size_t size, base_err *err)
{
    static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    if (size < sizeof signature || std::memcmp(data, signature, sizeof signature) != 0)
        return base_fail(err, BASE_EINVAL, "%s: not a PNG file", name);
    const auto be32 = [data](size_t at) {
        return static_cast<uint32_t>(data[at]) << 24 | static_cast<uint32_t>(data[at + 1]) << 16 |
               static_cast<uint32_t>(data[at + 2]) << 8 | static_cast<uint32_t>(data[at + 3]);
    };
    for (size_t at = sizeof signature; at < size;) {
        if (size - at < 12 || be32(at) > size - at - 12)
            return base_fail(err, BASE_EINVAL, "%s: truncated PNG file", name);
        const size_t length = be32(at);
        if (crc32(0, data + at + 4, static_cast<uInt>(length + 4)) != be32(at + 8 + length))
            return base_fail(err, BASE_EINVAL, "%s: damaged PNG file (checksum at byte %zu)", name, at);
        if (std::memcmp(data + at + 4, "IEND", 4) == 0)
            return 0;
        at += length + 12;
    }
    return base_fail(err, BASE_EINVAL, "%s: truncated PNG file", name);
}

int read_memory(const pic_request &q, pic_image *out, base_err *err)
{
    if (is_png(q.name))
        if (int rc = check_png(q.name, static_cast<const unsigned char *>(q.data), q.size, err))
            return rc;
    OIIO::Filesystem::IOMemReader reader(q.data, q.size);
    const char *dot = std::strrchr(q.name, '.');
    std::unique_ptr<ImageInput> input = ImageInput::create(dot != nullptr ? dot + 1 : q.name, false);
    if (!input || input->supports("ioproxy") == 0) {
        OIIO::geterror();
        return base_fail(err, BASE_EINVAL, "%s: this format cannot be read from memory", q.name);
    }
    ImageSpec config = raw_config(), spec;
    OIIO::Filesystem::IOProxy *proxy = &reader;
    config.attribute("oiio:ioproxy", TypeDesc::PTR, &proxy);
    if (!input->open(q.name, spec, config))
        return complain(q.name, input->geterror(), err);
    return read_pixels(*input, q, out, err);
}

int read_file(pic_request q, pic_image *out, base_err *err)
{
    if (int rc = base_file_check_input(q.name, err))
        return rc;
    if (is_png(q.name)) {
        char *data = nullptr;
        int rc = base_file_read(q.name, max_png, &data, &q.size, err);
        const memory owner(data);
        q.data = data;
        return rc ? rc : read_memory(q, out, err);
    }
    const ImageSpec config = raw_config();
    std::unique_ptr<ImageInput> input = ImageInput::open(q.name, &config);
    return input ? read_pixels(*input, q, out, err) : complain(q.name, OIIO::geterror(), err);
}

int answer(const pic_request *q, pic_image *out, base_err *err)
{
    try {
        configure_once();
        return q->data != nullptr ? read_memory(*q, out, err) : read_file(*q, out, err);
    } catch (const std::bad_alloc &) {
        return base_fail_nomem(err, q->name);
    } catch (const std::exception &e) {
        return complain(q->name, e.what(), err);
    }
}

/* --- headers --- */

int find_window(const ImageSpec &spec, const char *name, pic_window *out, base_err *err)
{
    const long long x = static_cast<long long>(spec.x) - spec.full_x, y = static_cast<long long>(spec.y) - spec.full_y;
    if (int rc = check_size(spec, name, err))
        return rc;
    if (x < 0 || y < 0 || x + spec.width > spec.full_width || y + spec.height > spec.full_height)
        return base_fail(err, BASE_EINVAL, "%s: it has pixels outside of its picture", name);
    const int32_t x0 = static_cast<int32_t>(x), y0 = static_cast<int32_t>(y);
    *out = pic_window{spec.full_width, spec.full_height, x0, y0, x0 + spec.width, y0 + spec.height};
    return 0;
}

/* Of a double all digits, which the library's own text has not. */
void find_attribute(const ImageSpec &spec, pic_attribute *a)
{
    const OIIO::ParamValue *found = spec.find_attribute(a->name);
    a->text[0] = '\0';
    if (found != nullptr && found->type() == TypeDesc::DOUBLE)
        std::snprintf(a->text, sizeof a->text, "%.17g", found->get<double>());
    else if (found != nullptr)
        std::snprintf(a->text, sizeof a->text, "%s", found->get_string().c_str());
}

int answer_header(const char *path, pic_window *window, pic_attribute *attributes, int count, base_err *err)
{
    try {
        configure_once();
        if (int rc = base_file_check_input(path, err))
            return rc;
        const std::unique_ptr<ImageInput> input = ImageInput::open(path);
        if (!input)
            return complain(path, OIIO::geterror(), err);
        std::for_each(attributes, attributes + count, [&](pic_attribute &a) { find_attribute(input->spec(), &a); });
        return find_window(input->spec(), path, window, err);
    } catch (const std::bad_alloc &) {
        return base_fail_nomem(err, path);
    } catch (const std::exception &e) {
        return complain(path, e.what(), err);
    }
}

} // namespace

extern "C" const struct pic_library pic_library = {answer, answer_header};
