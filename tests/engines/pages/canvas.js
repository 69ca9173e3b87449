// A canvas whose default framebuffer holds floats: for engines that draw to the canvas alone.

/** The context, and a function that reads the RGBA floats last drawn. */
export function floatCanvas(pixels) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = pixels;
  document.body.append(canvas);
  const gl = canvas.getContext("webgl2", { antialias: false, alpha: true, premultipliedAlpha: false });
  if (!gl?.getExtension("EXT_color_buffer_float")) throw new Error("no WebGL 2 with float targets");
  const bind = gl.bindFramebuffer.bind(gl);
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, pixels, pixels);
  gl.bindTexture(gl.TEXTURE_2D, null);
  const depth = gl.createRenderbuffer();
  gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH24_STENCIL8, pixels, pixels);
  gl.bindRenderbuffer(gl.RENDERBUFFER, null);
  const framebuffer = gl.createFramebuffer();
  bind(gl.FRAMEBUFFER, framebuffer);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_STENCIL_ATTACHMENT, gl.RENDERBUFFER, depth);

  gl.bindFramebuffer = (target, which) => bind(target, which ?? framebuffer);
  const drawBuffers = gl.drawBuffers.bind(gl), invalidate = gl.invalidateFramebuffer.bind(gl);
  gl.drawBuffers = (list) => drawBuffers(list.map((b) => (b === gl.BACK ? gl.COLOR_ATTACHMENT0 : b)));
  gl.invalidateFramebuffer = (target, list) => {
    if (!list.some((b) => b === gl.COLOR || b === gl.DEPTH || b === gl.STENCIL)) invalidate(target, list);
  };
  const read = () => {
    const rgba = new Float32Array(pixels * pixels * 4);
    const before = gl.getParameter(gl.READ_FRAMEBUFFER_BINDING);
    bind(gl.READ_FRAMEBUFFER, framebuffer);
    gl.readPixels(0, 0, pixels, pixels, gl.RGBA, gl.FLOAT, rgba);
    bind(gl.READ_FRAMEBUFFER, before);
    return rgba;
  };
  return { canvas, gl, read };
}
