/* OpenImageIO behind picture/oiio.h: the only C++ of the programs. Exceptions end here. */
extern "C" {
#include "base/bytes.h"
#include "base/files.h"
}

#include "picture/channels.h"
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
#include <vector>

#include <zlib.h>

namespace
{

using OIIO::ImageInput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

constexpr int max_channels = 1024;
constexpr size_t max_bytes = 1u << 30; /* of a file that is read before it is opened */

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

bool is_exr(const ImageInput &input) { return std::strcmp(input.format_name(), "openexr") == 0; }

/* Of an EXR all, of other formats the first. Channels are called as in the file: of luminance and chroma OpenImageIO 2.5
 * makes R, G and B. */
std::vector<ImageSpec> list_parts(ImageInput &input)
{
    std::vector<ImageSpec> parts{input.spec()};
    for (int part = 1; is_exr(input) && part < max_channels && input.seek_subimage(part, 0); part++)
        parts.push_back(input.spec());
    input.seek_subimage(0, 0);
    input.geterror(); /* there is no such part */
    for (ImageSpec &part : parts)
        if (part.get_int_attribute("openexr:luminancechroma") != 0)
            part.channelnames = {"Y", "RY", "BY"};
    return parts;
}

/* The first three, else the first one, and alpha: of other formats than EXR, whose names may say nothing. */
pic_choice choose_by_place(const ImageSpec &spec)
{
    pic_choice choice = {0, spec.nchannels >= 3 ? 3 : 1, {0, 1, 2, 0}};
    if (spec.alpha_channel >= choice.count)
        choice.at[choice.count++] = spec.alpha_channel;
    return choice;
}

/* Chooses among the channels of all parts. */
template <typename rule> int choose_among(ImageInput &input, const char *name, base_err *err, rule choose)
{
    const std::vector<ImageSpec> parts = list_parts(input);
    std::vector<pic_channel> list;
    for (size_t part = 0; part < parts.size(); part++) {
        const auto part_name = parts[part].get_string_attribute("oiio:subimagename");
        for (size_t c = 0; c < parts[part].channelnames.size(); c++)
            list.push_back({parts[part].channelnames[c].c_str(),
                            parts.size() == 1 || part_name.empty() ? nullptr : part_name.data(), static_cast<int>(part),
                            static_cast<int>(c)});
    }
    if (list.size() > PIC_MAX_CHANNELS)
        return base_fail(err, BASE_EINVAL, "%s: %zu channels (expected at most %d)", name, list.size(), PIC_MAX_CHANNELS);
    return choose(list.data(), static_cast<int>(list.size()));
}

int choose_picture(ImageInput &input, const char *name, pic_choice *out, base_err *err)
{
    return choose_among(input, name, err, [&](const pic_channel *list, int count) {
        base_err why = {};
        const int rc = pic_choose_channels(name, list, count, out, &why);
        if (rc == BASE_ENOMEM || (rc != 0 && is_exr(input)))
            return base_fail(err, rc, "%s", why.text);
        if (rc != 0)
            *out = choose_by_place(input.spec());
        return 0;
    });
}

int choose_layer(ImageInput &input, const pic_request &q, pic_choice *out, base_err *err)
{
    return choose_among(input, q.name, err, [&](const pic_channel *list, int count) {
        return pic_choose_layer(q.name, q.channel, list, count, out, err);
    });
}

/* In the first part that has it. */
int choose_channel(ImageInput &input, const pic_request &q, pic_choice *out, base_err *err)
{
    for (int part = 0; input.seek_subimage(part, 0); part++) {
        const ImageSpec &spec = input.spec();
        const auto at = std::find(spec.channelnames.begin(), spec.channelnames.end(), q.channel);
        if (at != spec.channelnames.end()) {
            *out = {part, 1, {static_cast<int>(at - spec.channelnames.begin())}};
            return 0;
        }
    }
    return base_fail(err, BASE_EINVAL, "%s: has no channel '%s'", q.name, q.channel);
}

int choose(ImageInput &input, const pic_request &q, pic_choice *out, base_err *err)
{
    if (q.wanted == PIC_LAYER)
        return choose_layer(input, q, out, err);
    if (q.wanted == PIC_CHANNEL)
        return choose_channel(input, q, out, err);
    int rc = choose_picture(input, q.name, out, err);
    if (!rc && q.wanted == PIC_DISPLAY) { /* grey is repeated, alpha dropped */
        for (int c = 1; c < 3 && out->count < 3; c++)
            out->at[c] = out->at[0];
        out->count = 3;
    }
    return rc;
}

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

/* The pixels of an image: where the stored ones begin, which may be outside. */
struct canvas {
    int width, height, x, y;
};

bool holds(const canvas &c, const ImageSpec &spec)
{
    return c.x >= 0 && c.y >= 0 && c.x + spec.width <= c.width && c.y + spec.height <= c.height;
}

/* A texture is a picture in its frame: what the file leaves out is black, what it has outside is left out. Other readers
 * take the stored pixels. */
int find_canvas(const ImageSpec &spec, const pic_request &q, canvas *out, base_err *err)
{
    *out = {spec.width, spec.height, 0, 0};
    const long long x = static_cast<long long>(spec.x) - spec.full_x, y = static_cast<long long>(spec.y) - spec.full_y;
    if (q.wanted != PIC_STORED || (x == 0 && y == 0 && spec.full_width == spec.width && spec.full_height == spec.height))
        return 0;
    ImageSpec whole = spec;
    whole.width = spec.full_width;
    whole.height = spec.full_height;
    if (int rc = check_size(whole, q.name, err))
        return rc;
    if (x >= whole.width || y >= whole.height || x + spec.width <= 0 || y + spec.height <= 0)
        return base_fail(err, BASE_EINVAL, "%s: all of its pixels lie outside of its picture", q.name);
    *out = {whole.width, whole.height, static_cast<int>(x), static_cast<int>(y)};
    return 0;
}

/* The chosen channels of all stored pixels, interleaved; `row` is from one row to the next, in bytes. */
int read_stored(ImageInput &input, const pic_request &q, const pic_choice &s, const ImageSpec &spec, TypeDesc type, char *to,
                size_t row, base_err *err)
{
    const size_t size = type.size(), pixel = static_cast<size_t>(s.count) * size;
    for (int c = 0, n = 1; c < s.count; c += n) {
        for (n = 1; c + n < s.count && s.at[c + n] == s.at[c] + n;)
            n++;
        if (c > 0 && s.at[c] == s.at[0]) { /* repeated */
            for (int y = 0; y < spec.height; y++)
                for (int x = 0; x < spec.width; x++) {
                    char *at = to + static_cast<size_t>(y) * row + static_cast<size_t>(x) * pixel;
                    std::memcpy(at + static_cast<size_t>(c) * size, at, size);
                }
        } else {
            input.geterror(); /* what was said before is no news */
            const bool is_read = input.read_image(s.part, 0, s.at[c], s.at[c] + n, type, to + static_cast<size_t>(c) * size,
                                                  static_cast<OIIO::stride_t>(pixel), static_cast<OIIO::stride_t>(row));
            const std::string why = input.geterror(); /* of a TIFF that is cut short it is all that tells */
            if (!is_read || !why.empty())
                return complain(q.name, why, err);
        }
    }
    return 0;
}

/* The same in their place on the canvas, which is black. */
int read_placed(ImageInput &input, const pic_request &q, const pic_choice &s, const ImageSpec &spec, TypeDesc type,
                const canvas &c, char *to, base_err *err)
{
    const size_t pixel = static_cast<size_t>(s.count) * type.size(), row = static_cast<size_t>(c.width) * pixel,
                 stored_row = static_cast<size_t>(spec.width) * pixel;
    if (holds(c, spec))
        return read_stored(input, q, s, spec, type, to + static_cast<size_t>(c.y) * row + static_cast<size_t>(c.x) * pixel,
                           row, err);
    memory stored(std::calloc(static_cast<size_t>(spec.height), stored_row));
    if (!stored)
        return base_fail_nomem(err, q.name);
    if (int rc = read_stored(input, q, s, spec, type, static_cast<char *>(stored.get()), stored_row, err))
        return rc;
    const int x0 = std::max(c.x, 0), x1 = std::min(c.x + spec.width, c.width);
    for (int y = std::max(c.y, 0); y < std::min(c.y + spec.height, c.height); y++)
        std::memcpy(to + static_cast<size_t>(y) * row + static_cast<size_t>(x0) * pixel,
                    static_cast<const char *>(stored.get()) + static_cast<size_t>(y - c.y) * stored_row +
                        static_cast<size_t>(x0 - c.x) * pixel,
                    static_cast<size_t>(x1 - x0) * pixel);
    return 0;
}

/* How the stored rows lie in the picture, counted as EXIF does: 1 as usual, from 5 on they are its columns. Of a file that
 * begins with columns, OpenImageIO counts Radiance's "+X +Y" as 6 and "-X -Y" as 8, which are EXIF's 8 and 6. What JPEG and
 * TIFF say is left to the viewer, as in pbrt. */
int orientation_of(const ImageInput &input, const ImageSpec &spec)
{
    const int n = std::strcmp(input.format_name(), "hdr") == 0 ? spec.get_int_attribute("Orientation", 1) : 1;
    return n == 6 || n == 8 ? 14 - n : n >= 1 && n <= 8 ? n : 1;
}

/* OpenImageIO mixes up the orders of DPX: what it writes as 3 it reads as 4, and of columns it exchanges the sizes only. */
int check_order(const ImageInput &input, const ImageSpec &spec, const char *name, base_err *err)
{
    if (std::strcmp(input.format_name(), "dpx") != 0 || spec.get_int_attribute("Orientation", 1) == 1)
        return 0;
    return base_fail(err, BASE_EINVAL,
                     "%s: a DPX whose first pixel is not at the top left, or not the first of a row: turn it", name);
}

/* Puts the pixels, of `pixel` bytes each, where the picture has them. */
int turn(const char *name, int orientation, size_t pixel, int *width, int *height, memory *values, base_err *err)
{
    const bool turned = orientation >= 5,
               from_right = orientation == 2 || orientation == 3 || orientation == 6 || orientation == 7,
               from_bottom = orientation == 3 || orientation == 4 || orientation >= 7;
    const size_t w = static_cast<size_t>(turned ? *height : *width), h = static_cast<size_t>(turned ? *width : *height);
    const size_t stored_width = static_cast<size_t>(*width);
    memory out(std::calloc(w * h, pixel));
    if (!out)
        return base_fail_nomem(err, name);
    for (size_t y = 0; y < h; y++)
        for (size_t x = 0; x < w; x++) {
            const size_t a = from_right ? w - 1 - x : x, b = from_bottom ? h - 1 - y : y;
            std::memcpy(static_cast<char *>(out.get()) + (y * w + x) * pixel,
                        static_cast<const char *>(values->get()) +
                            (turned ? a * stored_width + b : b * stored_width + a) * pixel,
                        pixel);
        }
    *values = std::move(out);
    *width = static_cast<int>(w);
    *height = static_cast<int>(h);
    return 0;
}

/* What a colour EXR says of its R, G and B (technical introduction to OpenEXR, "chromaticities"), unless it is Rec. 709: in
 * its header, or in that of the first part, since all parts share it. */
void find_primaries(ImageInput &input, const ImageSpec &spec, const pic_choice &s, pic_image *image)
{
    static const float rec709[8] = PIC_REC709_PRIMARIES;
    const float same = 1e-3f; /* closer than writers that round to three digits */
    if (s.count < 3 || s.at[1] == s.at[0] || !is_exr(input))
        return;
    const TypeDesc type(TypeDesc::FLOAT, 8);
    const ImageSpec first = input.spec(0, 0);
    const OIIO::ParamValue *found = spec.find_attribute("chromaticities", type);
    if (found == nullptr)
        found = first.find_attribute("chromaticities", type);
    if (found == nullptr)
        return;
    std::memcpy(image->primaries, found->data(), sizeof image->primaries);
    for (int i = 0; i < 8; i++)
        if (!(std::abs(image->primaries[i] - rec709[i]) <= same))
            image->has_primaries = 1;
}

/* What stands in a file's first bytes and its reader does not say. */
struct header {
    bool without_alpha = false; /* the picture is what stands in front of its alpha, if it has one */
    bool is_ordered = false;    /* channels are not those that the reader says, but these: */
    int order[4] = {0, 1, 2, 3};
};

int read_pixels(ImageInput &input, const pic_request &q, const header &h, pic_image *out, base_err *err)
{
    pic_choice s = {};
    if (int rc = choose(input, q, &s, err))
        return rc;
    if (h.without_alpha && s.count % 2 == 0)
        s.count--;
    for (int c = 0; c < s.count && h.is_ordered; c++)
        s.at[c] = h.order[s.at[c]];
    /* Sizes are checked before memory is taken for them: those that are stored, and those of the picture. */
    const ImageSpec spec = input.spec(s.part, 0);
    canvas c = {};
    if (int rc = check_size(spec, q.name, err))
        return rc;
    if (int rc = check_order(input, spec, q.name, err))
        return rc;
    if (int rc = find_canvas(spec, q, &c, err))
        return rc;
    const bool is_float = spec.format.is_floating_point();
    const bool is_codes = q.wanted == PIC_DISPLAY ? !is_float : q.wanted == PIC_STORED && spec.format == TypeDesc::UINT8;
    const TypeDesc type = is_codes ? TypeDesc::UINT8 : TypeDesc::FLOAT;
    memory values(std::calloc(static_cast<size_t>(c.width) * static_cast<size_t>(c.height),
                              static_cast<size_t>(s.count) * type.size()));
    if (!values)
        return base_fail_nomem(err, q.name);
    if (int rc = read_placed(input, q, s, spec, type, c, static_cast<char *>(values.get()), err))
        return rc;
    const int orientation = orientation_of(input, spec);
    const bool is_part = !(holds(c, spec) && c.width == spec.width && c.height == spec.height);
    if (orientation != 1)
        if (int rc =
                turn(q.name, orientation, static_cast<size_t>(s.count) * type.size(), &c.width, &c.height, &values, err))
            return rc;
    *out = pic_image{};
    out->width = c.width;
    out->height = c.height;
    out->channels = s.count;
    out->is_float_file = is_float;
    out->is_part = is_part;
    find_primaries(input, spec, s, out);
    if (is_codes)
        out->u8 = static_cast<uint8_t *>(values.release());
    else
        out->f32 = static_cast<float *>(values.release());
    return 0;
}

/* Keeps alpha as stored: pbrt never premultiplies. */
ImageSpec raw_config()
{
    ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    return config;
}

/* libpng prints on stderr when a file is damaged (and OpenImageIO then leaks), so damage is found before it sees the data:
 * signature, header, chunk lengths, checksums, end marker (PNG specification, §5). */
int check_png(const char *name, const unsigned char *data, size_t size, base_err *err)
{
    static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    if (size < sizeof signature || std::memcmp(data, signature, sizeof signature) != 0)
        return base_fail(err, BASE_EINVAL, "%s: not a PNG file", name);
    const auto be32 = [data](size_t at) { return __builtin_bswap32(base_get_u32(data + at)); };
    for (size_t at = sizeof signature; at < size;) {
        if (size - at < 12 || be32(at) > size - at - 12)
            return base_fail(err, BASE_EINVAL, "%s: truncated PNG file", name);
        const size_t length = be32(at);
        if (at == sizeof signature && (length != 13 || std::memcmp(data + at + 4, "IHDR", 4) != 0))
            return base_fail(err, BASE_EINVAL, "%s: damaged PNG file (it does not begin with its header)", name);
        if (crc32(0, data + at + 4, static_cast<uInt>(length + 4)) != be32(at + 8 + length))
            return base_fail(err, BASE_EINVAL, "%s: damaged PNG file (checksum at byte %zu)", name, at);
        if (std::memcmp(data + at + 4, "IEND", 4) == 0)
            return 0;
        at += length + 12;
    }
    return base_fail(err, BASE_EINVAL, "%s: truncated PNG file", name);
}

/* The first bytes of a file that is there, or of what is in memory. */
std::vector<unsigned char> head_of(const pic_request &q, size_t most)
{
    std::vector<unsigned char> head(most);
    FILE *file = nullptr;
    if (q.data != nullptr)
        head.assign(static_cast<const unsigned char *>(q.data),
                    static_cast<const unsigned char *>(q.data) + std::min(q.size, most));
    else if (base_file_open(q.name, &file, nullptr) == 0) {
        head.resize(std::fread(head.data(), 1, most, file));
        std::fclose(file);
    } else
        head.clear();
    return head;
}

/* One character ends the header of a PFM. Behind "\r\n" OpenImageIO would take the second for the first byte of the pixels,
 * which are nothing then: next to 0. */
int check_pfm(const pic_request &q, base_err *err)
{
    std::vector<unsigned char> head = head_of(q, 256);
    int at = 0;
    head.push_back('\0');
    std::sscanf(reinterpret_cast<const char *>(head.data()), "%*s%*s%*s%*s%n", &at); /* PF, width, height, scale */
    if (head[static_cast<size_t>(at)] == '\r' && head[static_cast<size_t>(at) + 1] == '\n' && at > 0)
        return base_fail(err, BASE_EINVAL, "%s: a PFM whose header ends in CR and LF (expected one of them)", q.name);
    return 0;
}

/* Pixels of 32 bits in a BMP have their colours where its masks say. OpenImageIO takes the bytes for blue, green, red and
 * alpha in any case. */
int find_bmp_order(const pic_request &q, header *out, base_err *err)
{
    enum { BITS = 28, COMPRESSION = 30, MASKS = 54, END = MASKS + 12 };
    static const int channel_of_byte[4] = {2, 1, 0, 3};
    const std::vector<unsigned char> head = head_of(q, END);
    if (head.size() < END || head[0] != 'B' || head[1] != 'M' || head[BITS] != 32 ||
        (head[COMPRESSION] != 3 && head[COMPRESSION] != 6))
        return 0;
    int left = 0 + 1 + 2 + 3;
    for (int c = 0; c < 3; c++) {
        int byte = 0;
        while (byte < 4 && base_get_u32(&head[static_cast<size_t>(MASKS + 4 * c)]) != 0xffu << 8 * byte)
            byte++;
        if (byte == 4)
            return base_fail(err, BASE_EINVAL, "%s: a BMP whose colours are no bytes (expected masks of 8 bits)", q.name);
        out->order[c] = channel_of_byte[byte];
        left -= byte;
    }
    out->order[3] = channel_of_byte[left >= 0 && left < 4 ? left : 3];
    out->is_ordered = true;
    return 0;
}

/* An image whose pixels can be asked for, and what it stands on; gone in the reverse order. */
struct opened {
    memory data;
    std::unique_ptr<OIIO::Filesystem::IOMemReader> reader;
    std::unique_ptr<ImageInput> input;
    header first_bytes;
};

int open_memory(const char *name, const void *data, size_t size, opened *out, base_err *err)
{
    if (base_file_has_ending(name, "png")) {
        const unsigned char *png = static_cast<const unsigned char *>(data);
        if (int rc = check_png(name, png, size, err))
            return rc;
        /* Where no alpha is stored with its pixels (colour types 4 and 6), but a transparent colour or transparent entries
         * of its palette (tRNS), pbrt reads the colours alone. */
        out->first_bytes.without_alpha = (png[25] & 4) == 0;
    }
    out->reader = std::make_unique<OIIO::Filesystem::IOMemReader>(data, size);
    const char *dot = std::strrchr(name, '.');
    out->input = ImageInput::create(OIIO::Strutil::lower(dot != nullptr ? dot + 1 : name), false);
    if (!out->input || out->input->supports("ioproxy") == 0) {
        OIIO::geterror();
        return base_fail(err, BASE_EINVAL, "%s: this format cannot be read from memory", name);
    }
    ImageSpec config = raw_config(), spec;
    OIIO::Filesystem::IOProxy *proxy = out->reader.get();
    config.attribute("oiio:ioproxy", TypeDesc::PTR, &proxy);
    return out->input->open(name, spec, config) ? 0 : complain(name, out->input->geterror(), err);
}

/* A name with '?' is an address with a query to OpenImageIO: such a file is given to it as bytes. */
int open_file(const char *path, opened *out, base_err *err)
{
    if (int rc = base_file_check_input(path, err))
        return rc;
    if (base_file_has_ending(path, "png") || std::strchr(path, '?') != nullptr) {
        char *data = nullptr;
        size_t size = 0;
        const int rc = base_file_read(path, max_bytes, &data, &size, err);
        out->data = memory(data);
        return rc ? rc : open_memory(path, data, size, out, err);
    }
    if (base_file_has_ending(path, "pfm"))
        if (int rc = check_pfm({PIC_STORED, path, nullptr, 0, nullptr}, err))
            return rc;
    const ImageSpec config = raw_config();
    out->input = ImageInput::open(path, &config);
    return out->input ? 0 : complain(path, OIIO::geterror(), err);
}

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

/* What `work` returns, or what it throws as an error. */
template <typename work> int guarded(const char *name, base_err *err, work work_on)
{
    try {
        configure_once();
        opened image;
        return work_on(image);
    } catch (const std::bad_alloc &) {
        return base_fail_nomem(err, name);
    } catch (const std::exception &e) {
        return complain(name, e.what(), err);
    }
}

int answer(const pic_request *q, pic_image *out, base_err *err)
{
    return guarded(q->name, err, [&](opened &image) {
        int rc = q->data != nullptr ? open_memory(q->name, q->data, q->size, &image, err) : open_file(q->name, &image, err);
        if (rc == 0 && base_file_has_ending(q->name, "bmp"))
            rc = find_bmp_order(*q, &image.first_bytes, err);
        return rc ? rc : read_pixels(*image.input, *q, image.first_bytes, out, err);
    });
}

int answer_header(const char *path, pic_window *window, pic_attribute *attributes, int count, base_err *err)
{
    return guarded(path, err, [&](opened &image) {
        if (int rc = open_file(path, &image, err))
            return rc;
        const ImageSpec &spec = image.input->spec();
        std::for_each(attributes, attributes + count, [&](pic_attribute &a) { find_attribute(spec, &a); });
        if (int rc = find_window(spec, path, window, err))
            return rc;
        if (orientation_of(*image.input, spec) >= 5)
            *window = pic_window{window->height, window->width, window->y0, window->x0, window->y1, window->x1};
        return 0;
    });
}

} // namespace

extern "C" const struct pic_library pic_library = {answer, answer_header};
