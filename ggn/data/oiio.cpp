// OpenImageIO behind ggn/data/oiio.h: the only C++ in ggn. Exceptions end here.
extern "C" {
#include "base/files.h"
}

#include "data/oiio.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

namespace
{

using OIIO::ImageInput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

int complain(const char *path, struct base_err *err)
{
    std::string why = OIIO::geterror();
    if (why.empty())
        why = "not an image that can be read";
    size_t line = why.find('\n');
    if (line != std::string::npos)
        why.resize(line);
    if (why.compare(0, strlen(path), path) == 0)
        return base_fail(err, BASE_EINVAL, "%s", why.c_str());
    return base_fail(err, BASE_EINVAL, "%s: %s", path, why.c_str());
}

int complain(const char *path, ImageInput &in, struct base_err *err)
{
    std::string why = in.geterror();
    return base_fail(err, BASE_EINVAL, "%s: %s", path,
                     why.empty() ? "cannot be decoded" : why.substr(0, why.find('\n')).c_str());
}

bool sane(const ImageSpec &spec)
{
    return spec.width >= 1 && spec.height >= 1 && spec.depth <= 1 && spec.width <= GGN_IMAGE_MAX_SIDE &&
           spec.height <= GGN_IMAGE_MAX_SIDE && (long long)spec.width * spec.height <= GGN_IMAGE_MAX_PIXELS &&
           spec.nchannels >= 1 && spec.nchannels <= 1024;
}

// Reads the channels [begin, end) of a subimage as T.
template <class T>
int read_pixels(ImageInput &in, const char *path, int subimage, int begin, int end, std::vector<T> &pixels,
                struct base_err *err)
{
    ImageSpec spec = in.spec_dimensions(subimage, 0);
    size_t n = (size_t)spec.width * (size_t)spec.height * (size_t)(end - begin);
    pixels.resize(n);
    TypeDesc type(sizeof(T) == 1 ? TypeDesc::UINT8 : TypeDesc::FLOAT);
    if (!in.read_image(subimage, 0, begin, end, type, pixels.data()))
        return complain(path, in, err);
    return 0;
}

// Where R, G, B are among the channels: by name, else the first three, else the first one repeated.
void find_rgb(const ImageSpec &spec, int rgb[3])
{
    static const char *const names[3] = {"R", "G", "B"};
    int found = 0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < spec.nchannels; i++)
            if (spec.channelnames[(size_t)i] == names[c]) {
                rgb[c] = i;
                found++;
                break;
            }
    if (found != 3)
        for (int c = 0; c < 3; c++)
            rgb[c] = spec.nchannels >= 3 ? c : 0;
}

// Bytes are not taken from a file of floats: only *is_float is set then.
template <class T, class Image> int read_rgb(const char *path, Image *image, int *is_float, struct base_err *err)
{
    if (int rc = base_file_check_input(path, err))
        return rc;
    OIIO::ImageSpec config;
    config["oiio:UnassociatedAlpha"] = 1;
    std::unique_ptr<ImageInput> in = ImageInput::open(path, &config);
    if (!in)
        return complain(path, err);
    ImageSpec spec = in->spec();
    if (!sane(spec))
        return base_fail(err, BASE_EINVAL, "%s: %dx%d is not a size that can be used", path, spec.width, spec.height);
    *is_float = spec.format.is_floating_point();
    if (*is_float && sizeof(T) == 1)
        return 0;
    int rgb[3];
    find_rgb(spec, rgb);
    int lo = std::min(rgb[0], std::min(rgb[1], rgb[2])), hi = std::max(rgb[0], std::max(rgb[1], rgb[2])) + 1;
    std::vector<T> pixels;
    int rc = read_pixels(*in, path, 0, lo, hi, pixels, err);
    if (rc)
        return rc;
    size_t count = (size_t)spec.width * (size_t)spec.height, step = (size_t)(hi - lo);
    T *data = static_cast<T *>(malloc(count * 3 * sizeof(T)));
    if (!data)
        return base_fail_nomem(err, path);
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            data[3 * i + (size_t)c] = pixels[i * step + (size_t)(rgb[c] - lo)];
    image->width = spec.width;
    image->height = spec.height;
    image->data = data;
    return 0;
}

template <class F> int guarded(const char *path, struct base_err *err, F body)
{
    try {
        return body();
    } catch (const std::bad_alloc &) {
        return base_fail_nomem(err, path);
    } catch (...) {
        return base_fail(err, BASE_EINVAL, "%s: cannot be read", path);
    }
}

int find_channel(const char *path, const char *channel, struct ggn_imagef *image, struct base_err *err)
{
    if (int rc = base_file_check_input(path, err))
        return rc;
    std::unique_ptr<ImageInput> in = ImageInput::open(path);
    if (!in)
        return complain(path, err);
    for (int part = 0; in->seek_subimage(part, 0); part++) {
        ImageSpec spec = in->spec();
        for (int c = 0; c < spec.nchannels; c++) {
            if (spec.channelnames[(size_t)c] != channel)
                continue;
            if (!sane(spec))
                return base_fail(err, BASE_EINVAL, "%s: %dx%d is not a size that can be used", path, spec.width,
                                 spec.height);
            std::vector<float> pixels;
            int rc = read_pixels(*in, path, part, c, c + 1, pixels, err);
            if (rc)
                return rc;
            float *data = static_cast<float *>(malloc(pixels.size() * sizeof(float)));
            if (!data)
                return base_fail_nomem(err, path);
            memcpy(data, pixels.data(), pixels.size() * sizeof(float));
            *image = {spec.width, spec.height, 1, data};
            return 0;
        }
    }
    return base_fail(err, BASE_EINVAL, "%s: has no channel '%s'", path, channel);
}

int read_display(const char *path, struct ggn_image8 *image, int *is_float, struct base_err *err)
{
    return guarded(path, err, [&] { return read_rgb<uint8_t>(path, image, is_float, err); });
}

int read_linear(const char *path, struct ggn_imagef *image, struct base_err *err)
{
    int is_float = 0;
    image->channels = 3;
    return guarded(path, err, [&] { return read_rgb<float>(path, image, &is_float, err); });
}

int read_channel(const char *path, const char *channel, struct ggn_imagef *image, struct base_err *err)
{
    return guarded(path, err, [&] { return find_channel(path, channel, image, err); });
}

} // namespace

extern "C" const struct ggn_oiio_library ggn_oiio_library = {read_display, read_linear, read_channel};
