// One vocabulary for #version 100 and 300 es.
#ifdef RELIT_FRAGMENT
#ifdef RELIT_MEDIUMP
precision mediump float;
precision mediump sampler2D;
precision mediump samplerCube;
#else
precision highp float;
precision highp sampler2D;
precision highp samplerCube;
#endif
#endif

#ifdef RELIT_ES3
#define ATTRIBUTE in
#define SAMPLE_2D texture
#define SAMPLE_CUBE texture
#ifdef RELIT_FRAGMENT
#define VARYING in
out vec4 relit_color;
#define FRAG_COLOR relit_color
#else
#define VARYING out
#endif
#else
#define ATTRIBUTE attribute
#define VARYING varying
#define SAMPLE_2D texture2D
#define SAMPLE_CUBE textureCube
#define FRAG_COLOR gl_FragColor
#endif
